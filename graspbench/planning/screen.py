"""From many first grasps to the few local optima worth showing to the hand."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from graspbench.arrays import BoolArray, IntArray
from graspbench.planning.index import ClimbingIndex, Index, Moves, free_moves
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
    nearest = nearest_allowed(surface, allowed)
    for initial in starts:
        first = nearest[initial.vertices]
        if len(set(first.tolist())) < len(first):
            continue
        path = climb_freely(index, surface, first, allowed, thorough=False, max_moves=max_moves)
        optimum = LocalOptimum(initial, path, index.score(surface, path[-1]))
        reached.setdefault(optimum.contacts, optimum)
    return sorted(reached.values(), key=lambda optimum: -optimum.score)


def polish(
    index: Index, surface: Surface, optimum: LocalOptimum, allowed: BoolArray, max_moves: int
) -> LocalOptimum:
    """Climb on with several contacts at a time; arguments as those of ``screen``."""
    further = climb_freely(index, surface, optimum.vertices, allowed, thorough=True, max_moves=max_moves)
    path = np.vstack((optimum.path, further[1:]))
    return LocalOptimum(optimum.initial, path, index.score(surface, path[-1]))


def nearest_allowed(surface: Surface, allowed: BoolArray) -> IntArray:
    """Return for every node the nearest allowed one, itself if it is, shape (n_s,)."""
    nearest = np.arange(len(allowed))
    if allowed.any() and not allowed.all():
        _, found = cKDTree(surface.points[allowed]).query(surface.points[~allowed])
        nearest[~allowed] = np.flatnonzero(allowed)[found]
    return nearest


def climb_freely(
    index: Index, surface: Surface, vertices: IntArray, allowed: BoolArray, *, thorough: bool, max_moves: int
) -> IntArray:
    """Climb by the index's own compiled climb if it has one, else proposal by proposal.

    Args:
        index: What to climb.
        surface: Any snapshot.
        vertices: Where to start, shape (n_f,).
        allowed: Nodes that contacts may move to, shape (n_s,).
        thorough: Whether to look as closely as on a surface at rest.
        max_moves: Moves after which the climb is given up.

    Returns:
        The configurations on the way, first to last, shape (moves + 1, n_f).
    """
    if isinstance(index, ClimbingIndex):
        return index.climb(surface, vertices, allowed, thorough=thorough, max_moves=max_moves)
    steps, visited = [vertices], {tuple(vertices.tolist())}
    for _ in range(max_moves):
        moves = free_moves(surface, steps[-1])
        nodes = np.where(allowed[moves.nodes] & (moves.nodes >= 0), moves.nodes, -1)
        nodes[:, 0] = steps[-1]
        proposed = index.propose(surface, steps[-1], Moves(nodes, moves.barrier, moves.barrier_force))
        if proposed is None or tuple(proposed.tolist()) in visited:
            break
        visited.add(tuple(proposed.tolist()))
        steps.append(proposed)
    return np.array(steps)
