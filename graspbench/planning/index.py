"""What a grasp quality index is to the local planner (thesis 3.4 and appendix A).

An index looks at the surface, the vertices that the fingers touch and the moves that the hand allows,
and proposes the next vertices, or says that none is better. The planner asks again and again until
the index has nothing to propose: that is a local optimum. `Index` is all that is asked of an index, so any
grasp quality that can be read off a discretised surface can guide the fingers; the module
`graspbench.planning.indices.quality_ascent` is the shortest complete example. What an index may offer
beyond that stands in `CentringIndex` and `ClimbingIndex`.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.registry import Registry

if TYPE_CHECKING:
    from graspbench.grasp.quality import QualityParameters
    from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class Moves:
    """Where each finger may go in one move, and what the hand thinks of it.

    Attributes:
        nodes: Allowed vertices of each finger, shape (n_f, k), -1 where there is none. Column 0 is the vertex
            that the finger touches now; the others are reachable nodes of the contour around it.
        barrier: Barrier value at each of these vertices, N, shape (n_f, k); 0 far from every limit.
        barrier_force: Kinematic barrier force f_b on each contact, N, shape (n_f, 3).
    """

    nodes: IntArray
    barrier: FloatArray
    barrier_force: FloatArray


class Index(Protocol):
    """A grasp quality index that the local planner can climb.

    An implementation is a class whose constructor takes ``(parameters, n_f, quality)``: its own
    parameters, the number of fingers, and how grasp quality is measured. It raises ConfigurationError when
    it is not defined for ``n_f`` fingers.
    """

    parameters: ClassVar[type[Any]]
    """Frozen dataclass of the index's parameters, every field with a default."""

    def propose(self, surface: "Surface", vertices: IntArray, moves: Moves) -> IntArray | None:
        """Return the next vertices, one of ``moves.nodes`` for each finger, or None at a local optimum.

        Args:
            surface: The reconstruction surface at this moment.
            vertices: Current contacts, shape (n_f,).
            moves: Allowed moves; column 0 is to stay.
        """
        ...

    def score(self, surface: "Surface", vertices: IntArray) -> float:
        """Return how good the index finds a grasp, higher is better, barrier left out."""
        ...


class CentringIndex(Index, Protocol):
    """An index that can pull the centre of grip to the centroid, as the thesis' with k_cm > 0.

    Where it does, whatever is compared with its grasps is held to the same: the global search leaves out
    grasps whose centre of grip is far from the centroid (thesis 3.6).
    """

    centre_option: ClassVar[str]
    """Which of its parameters is the gain of that pull; 0 switches it off."""


class Climbs(NamedTuple):
    """The ways of some grasps to their local optima, one after the other.

    Attributes:
        paths: All configurations, shape (n, n_f).
        first: Row of each way's first configuration, and n at the end, shape (m + 1,).
    """

    paths: IntArray
    first: IntArray

    @property
    def ends(self) -> IntArray:
        """Where the ways end, shape (m, n_f)."""
        ends: IntArray = self.paths[self.first[1:] - 1]
        return ends

    def path(self, rank: int) -> IntArray:
        """Return the configurations of one way, shape (moves + 1, n_f)."""
        path: IntArray = self.paths[self.first[rank] : self.first[rank + 1]]
        return path


@runtime_checkable
class ClimbingIndex(Index, Protocol):
    """An index that moves many grasps at once where no hand holds the fingers back; much faster."""

    def climb_all(
        self, surface: "Surface", starts: IntArray, allowed: BoolArray, *, thorough: bool, max_moves: int
    ) -> Climbs:
        """Follow its own proposals from every start to a local optimum.

        Args:
            surface: Any snapshot.
            starts: Where to start, shape (m, n_f).
            allowed: Nodes that contacts may move to, shape (n_s,).
            thorough: Whether to look as closely as on a surface at rest.
            max_moves: Moves after which a climb stops.
        """
        ...

    def scores(self, surface: "Surface", grasps: IntArray) -> FloatArray:
        """Return the score of many grasps, shape (m,), from vertices of shape (m, n_f)."""
        ...


INDICES: Registry[Any] = Registry("index", "graspbench.planning.indices")
"""All indices by name; other distributions add theirs by the entry point group ``graspbench.index``."""


def make_index(name: str, parameters: Any, n_f: int, quality: "QualityParameters | None" = None) -> Index:
    """Build a registered index.

    Args:
        name: Its registered name.
        parameters: An instance of its ``parameters`` dataclass.
        n_f: Number of fingers.
        quality: How grasp quality is measured, for indices that read it; None for the defaults.

    Raises:
        ConfigurationError: No such index, or it is not defined for ``n_f`` fingers.
    """
    index: Index = INDICES[name](parameters, n_f, quality)
    return index


def centre_option(name: str) -> str | None:
    """Return which parameter of an index pulls to the centroid; None when it is no `CentringIndex`.

    Args:
        name: Its registered name.

    Raises:
        ConfigurationError: No such index.
    """
    option: str | None = getattr(INDICES[name], "centre_option", None)
    return option


def centre_gain(name: str, parameters: Any) -> float | None:
    """Return an index's gain to the centroid; None when it is no `CentringIndex`.

    Args:
        name: Its registered name.
        parameters: An instance of its ``parameters`` dataclass.

    Raises:
        ConfigurationError: No such index.
    """
    option = centre_option(name)
    return None if option is None else float(getattr(parameters, option))


def free_moves(surface: "Surface", vertices: IntArray) -> Moves:
    """Return the moves of fingers that no hand holds back: the whole contours.

    Args:
        surface: Any snapshot.
        vertices: Current contacts, shape (n_f,).
    """
    nodes = contour_nodes(surface, vertices)
    return Moves(nodes, np.zeros(nodes.shape), np.zeros((len(vertices), 3)))


def contour_nodes(surface: "Surface", vertices: IntArray) -> IntArray:
    """Return each contact's vertex and the contour around it.

    Args:
        surface: Any snapshot.
        vertices: Current contacts, shape (n_f,).

    Returns:
        Shape (n_f, k), column 0 the vertices, short rows filled with -1.
    """
    start = surface.network.contour_start
    counts = start[vertices + 1] - start[vertices]
    nodes = np.full((len(vertices), 1 + int(counts.max())), -1, dtype=np.int64)
    nodes[:, 0] = vertices
    for i, vertex in enumerate(vertices):
        nodes[i, 1 : 1 + counts[i]] = surface.network.contour_nodes[start[vertex] : start[vertex + 1]]
    return nodes
