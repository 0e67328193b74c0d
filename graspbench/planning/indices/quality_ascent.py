"""Climb a classical quality measure on the contours: the example of how to write an index.

An index is one class in one module of this package, or in any other distribution that declares the entry
point

    [project.entry-points."graspbench.index"]
    my_index = "my_package.my_module:MyIndex"

It needs four things, all in this file: a frozen dataclass of parameters with defaults, which becomes the
configuration group ``index``; a constructor that takes these, the number of fingers and the quality
parameters; ``propose``, which returns the next contacts or None at a local optimum; and ``score``, which
the planner ranks local optima by. Which moves are allowed is not the index's business: the hand has decided
that in ``moves.nodes``.
"""

from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.planning.index import INDICES, Moves
from graspbench.reconstruction.surface import Surface

if TYPE_CHECKING:
    from graspbench.grasp.quality import QualityParameters

_NOT_CLOSED = 1e3
"""What a grasp that is not force closure loses: more than any measure can make up for."""

_DIRECTIONS = 128
"""Directions in which the support is looked at for a first bound of Q3."""


@dataclass(frozen=True)
class QualityAscentParameters:
    """Which quality is climbed: a weighted sum of Q1, Q2 and Q3 (thesis 3.6)."""

    weight_q1: Annotated[float, Field(ge=0, description="Weight of Q1, the smallest singular value")] = 0.0
    weight_q2: Annotated[float, Field(ge=0, description="Weight of Q2, the volume of the ellipsoid")] = 0.0
    weight_q3: Annotated[
        float, Field(ge=0, description="Weight of Q3, the largest resisted perturbation")
    ] = 1.0
    pairs: Annotated[
        bool, Field(description="Once the surface rests, move two contacts together when no single one helps")
    ] = True
    centre_tolerance_m: Annotated[
        float | None,
        Field(description="Largest distance of the contacts' mean from the centroid; null: any"),
    ] = None


@INDICES.register("quality_ascent")
class QualityAscent:
    """Index that takes the move with the highest quality.

    Args:
        parameters: The weights.
        n_f: Number of fingers.
        quality: Contact model and wrench space; None for the defaults.

    Raises:
        ConfigurationError: All weights are zero.
    """

    parameters: ClassVar[type[QualityAscentParameters]] = QualityAscentParameters

    def __init__(
        self, parameters: QualityAscentParameters, n_f: int, quality: "QualityParameters | None" = None
    ) -> None:
        from graspbench.grasp.quality import QualityParameters

        self._weights = np.array([parameters.weight_q1, parameters.weight_q2, parameters.weight_q3])
        if not self._weights.any():
            raise ConfigurationError(
                "all weights of the quality ascent are zero", remedy="set index.weight_q3 = 1"
            )
        self._parameters = parameters
        self._quality = quality or QualityParameters()
        self._surface: Surface | None = None
        self._known: dict[bytes, float] = {}  # what grasps are worth on this surface
        self._length_m = 1.0

    def propose(self, surface: Surface, vertices: IntArray, moves: Moves) -> IntArray | None:
        """Return the best move of one contact, of two at rest if one does not help, or None."""
        here = self.score(surface, vertices)
        sizes = (1, 2) if self._parameters.pairs and surface.at_rest else (1,)
        for fingers_at_once in sizes:
            candidates = _candidates(vertices, moves, fingers_at_once)
            # Less than rounding is no progress, and could go in circles.
            found = self._best(surface, candidates, here + 1e-9 * max(1.0, abs(here)))
            if found is not None:
                return found
        return None

    def score(self, surface: Surface, vertices: IntArray) -> float:
        """Return the weighted quality; a grasp that is not force closure loses more than it can have."""
        known = self._known.get(vertices.tobytes()) if surface is self._surface else None
        if known is None:
            maps = self._maps(surface, vertices[None])
            known = self._value(maps[0], float(self._without_q3(surface, vertices[None], maps)[0]), -np.inf)
            self._known[vertices.tobytes()] = known
        return known

    def _best(self, surface: Surface, candidates: IntArray, floor: float) -> IntArray | None:
        """Return the best of many grasps if it is worth more than ``floor``.

        They are looked at in the order of a bound of their worth, each as long as it may be the best one.
        """
        if not len(candidates):
            return None
        from graspbench.planning.merit import support_bounds

        maps = self._maps(surface, candidates)
        rest = self._without_q3(surface, candidates, maps)
        q3 = support_bounds(maps, self._quality, self._length_m, tight=False, directions=_DIRECTIONS)
        bounds = self._with_q3(rest, q3)
        best: IntArray | None = None
        for k in np.argsort(-bounds, kind="stable"):
            if bounds[k] <= floor:
                break
            value = self._value(maps[k], float(rest[k]), floor)
            if value > floor:
                best, floor = candidates[k], value
        if best is not None:
            self._known[best.tobytes()] = floor
        return best

    def _value(self, maps: FloatArray, rest: float, floor: float) -> float:
        """Return a grasp's worth, or some value up to ``floor`` as soon as it is known not to exceed that."""
        from graspbench.grasp.epsilon import CLOSURE_TOLERANCE, smallest_support

        weight = self._weights[2]
        needed = max(CLOSURE_TOLERANCE, (floor - rest) / weight) if weight > 0.0 else CLOSURE_TOLERANCE
        polytope = self._quality.polytope(self._length_m)
        wrenches = polytope.vertices @ np.swapaxes(maps, -1, -2)
        minkowski = self._quality.norm == "linf"
        q3 = smallest_support(wrenches[None], polytope, minkowski=minkowski, stop_at=needed)
        q3 = np.where(q3 > CLOSURE_TOLERANCE, q3, 0.0)
        return float(self._with_q3(np.array([rest]), q3)[0])

    def _with_q3(self, rest: FloatArray, q3: FloatArray) -> FloatArray:
        """Return the worth of grasps, shape (n,), less for what is not force closure."""
        values: FloatArray = rest + self._weights[2] * q3 - _NOT_CLOSED * (q3 <= 0.0)
        return values

    def _without_q3(self, surface: Surface, candidates: IntArray, maps: FloatArray) -> FloatArray:
        """Return the weighted sum of Q1 and Q2, shape (n,), less for what is too far off the centroid."""
        from graspbench.grasp.quality import singular_measures
        from graspbench.grasp.wrench import grasp_matrix

        values = np.zeros(len(candidates))
        if self._weights[:2].any():
            q1, q2 = singular_measures(grasp_matrix(maps))
            values = self._weights[0] * q1 + self._weights[1] * q2
        tolerance = self._parameters.centre_tolerance_m
        if tolerance is not None:
            centres = surface.points[candidates].mean(axis=1)
            away = np.linalg.norm(centres - surface.centroid, axis=1) - tolerance
            values -= np.where(away > 0.0, _NOT_CLOSED * (1.0 + away), 0.0)
        return values

    def _maps(self, surface: Surface, candidates: IntArray) -> FloatArray:
        from graspbench.grasp.wrench import wrench_maps

        if surface is not self._surface:
            self._surface = surface
            self._known.clear()
            self._length_m = self._quality.torque_length_m(surface.points, surface.centroid)
        return wrench_maps(
            surface.points[candidates],
            -surface.normals[candidates],
            surface.centroid,
            contact=self._quality.contact,
            wrench_space=self._quality.wrench_space,
            torque_length=self._length_m,
        )


def _candidates(vertices: IntArray, moves: Moves, fingers_at_once: int) -> IntArray:
    """Return the grasps that moving so many contacts leads to, shape (n, n_f)."""
    found = []
    for fingers in combinations(range(len(vertices)), fingers_at_once):
        options = [moves.nodes[i, 1:][moves.nodes[i, 1:] >= 0] for i in fingers]
        for nodes in product(*options):
            grasp = vertices.copy()
            grasp[list(fingers)] = nodes
            if len(set(grasp.tolist())) == len(grasp):
                found.append(grasp)
    return np.array(found, dtype=np.int64).reshape(-1, len(vertices))
