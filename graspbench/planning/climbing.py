"""Climbs of many grasps over a surface, limited by nothing but where a fingertip can be."""

from functools import cache

import numpy as np
from typing_extensions import TypeIs

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.planning.index import ClimbingIndex, Climbs, Index, Moves, free_moves
from graspbench.reconstruction.surface import Surface


def climbs_by_itself(index: Index) -> TypeIs[ClimbingIndex]:
    """Tell whether an index is a `ClimbingIndex`; each class of indices is looked at once."""
    return _is_climbing(type(index))


@cache
def _is_climbing(kind: type) -> bool:
    return hasattr(kind, "climb_all") and hasattr(kind, "scores")


def climb_all(
    index: Index, surface: Surface, starts: IntArray, allowed: BoolArray, *, thorough: bool, max_moves: int
) -> Climbs:
    """Climb by the index's own compiled climb if it has one, else proposal by proposal.

    Args:
        index: What to climb.
        surface: Any snapshot.
        starts: Where to start, shape (m, n_f).
        allowed: Nodes that contacts may move to, shape (n_s,).
        thorough: Whether to look as closely as on a surface at rest.
        max_moves: Moves after which a climb is given up.
    """
    if climbs_by_itself(index):
        return index.climb_all(surface, starts, allowed, thorough=thorough, max_moves=max_moves)
    paths = [_climb(index, surface, vertices, allowed, max_moves) for vertices in starts]
    first = np.cumsum([0, *(len(path) for path in paths)])
    return Climbs(np.concatenate([starts[:0], *paths]), first)


def scores(index: Index, surface: Surface, grasps: IntArray) -> FloatArray:
    """Return what an index thinks of many grasps, shape (m,), from vertices of shape (m, n_f)."""
    if climbs_by_itself(index):
        return index.scores(surface, grasps)
    return np.array([index.score(surface, vertices) for vertices in grasps])


def moved_to_allowed(surface: Surface, grasps: IntArray, allowed: BoolArray) -> IntArray:
    """Return grasps whose contacts are allowed ones: each that is not gives way to the nearest that is.

    Args:
        surface: Any snapshot.
        grasps: Vertices, shape (m, n_f).
        allowed: Nodes where contacts may be, shape (n_s,); where there are none, nothing is changed.
    """
    there = np.flatnonzero(allowed)
    blocked = np.unique(grasps[~allowed[grasps]])
    if not len(there) or not len(blocked):
        return grasps
    places, free = surface.points[blocked], surface.points[there]
    # The common square of a blocked node does not change which one is nearest.
    apart = np.einsum("ij,ij->i", free, free)[None] - 2.0 * places @ free.T
    moved = grasps.copy()
    outside = ~allowed[grasps]
    moved[outside] = there[apart.argmin(axis=1)][np.searchsorted(blocked, grasps[outside])]
    return moved


def all_different(grasps: IntArray) -> BoolArray:
    """Tell which grasps touch no node twice, shape (m,), from vertices of shape (m, n_f)."""
    ordered = np.sort(grasps, axis=1)
    different: BoolArray = (ordered[:, 1:] != ordered[:, :-1]).all(axis=1)
    return different


def _climb(
    index: Index, surface: Surface, vertices: IntArray, allowed: BoolArray, max_moves: int
) -> IntArray:
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
