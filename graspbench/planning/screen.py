"""From many first grasps to the few local optima worth showing to the hand."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import BoolArray, IntArray
from graspbench.planning.climbing import all_different, climb_all, moved_to_allowed, scores
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class LocalOptimum:
    """A grasp that the index cannot better while only the ground holds the fingers back.

    Attributes:
        initial: The first grasp it was reached from.
        path: Configurations on the way, first to last, shape (moves + 1, n_f).
        score: What the index thinks of the last one.
    """

    initial: InitialGrasp
    path: IntArray
    score: float

    @property
    def vertices(self) -> IntArray:
        """The local optimum, shape (n_f,)."""
        vertices: IntArray = self.path[-1]
        return vertices

    @property
    def contacts(self) -> tuple[int, ...]:
        """Its vertices in ascending order: equal for grasps that touch the same places."""
        return tuple(sorted(self.vertices.tolist()))


def screen(
    index: Index, surface: Surface, starts: list[InitialGrasp], allowed: BoolArray, max_moves: int
) -> list[LocalOptimum]:
    """Follow many first grasps to where no contact alone wants to move, without the hand.

    Args:
        index: What to climb.
        surface: The surface at rest.
        starts: First grasps; contacts that are not allowed start at the nearest allowed nodes.
        allowed: Nodes that a fingertip can touch at all, shape (n_s,).
        max_moves: Moves after which a climb is given up.

    Returns:
        The local optima, all different, best score first; equal scores in the order of ``starts``.
    """
    reached: dict[tuple[int, ...], LocalOptimum] = {}
    firsts = moved_to_allowed(surface, np.stack([start.vertices for start in starts]), allowed)
    whole = all_different(firsts)
    climbs = climb_all(index, surface, firsts[whole], allowed, thorough=False, max_moves=max_moves)
    for rank, score in enumerate(scores(index, surface, climbs.ends)):
        optimum = LocalOptimum(starts[np.flatnonzero(whole)[rank]], climbs.path(rank), float(score))
        reached.setdefault(optimum.contacts, optimum)
    return sorted(reached.values(), key=lambda optimum: -optimum.score)


def polish(
    index: Index, surface: Surface, optimum: LocalOptimum, allowed: BoolArray, max_moves: int
) -> LocalOptimum:
    """Climb on with several contacts at a time; arguments as those of ``screen``."""
    further = climb_all(index, surface, optimum.path[-1:], allowed, thorough=True, max_moves=max_moves)
    path = np.vstack((optimum.path, further.paths[1:]))
    return LocalOptimum(optimum.initial, path, index.score(surface, path[-1]))
