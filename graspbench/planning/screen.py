"""From many first grasps to the few local optima worth showing to the hand."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import BoolArray, IntArray
from graspbench.planning.index import Index, Moves, free_moves
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


def screen(
    index: Index, surface: Surface, starts: list[InitialGrasp], allowed: BoolArray, keep: int, max_moves: int
) -> list[LocalOptimum]:
    """Follow many first grasps to their local optima, without the hand, and keep the best ones.

    Args:
        index: What to climb.
        surface: The surface at rest.
        starts: First grasps.
        allowed: Nodes that a fingertip can touch at all, shape (n_s,).
        keep: Number of different local optima to return.
        max_moves: Moves after which a climb is given up.

    Returns:
        The local optima, best score first; equal scores in the order of ``starts``.
    """
    reached: dict[tuple[int, ...], LocalOptimum] = {}
    for initial in starts:
        path = _climb(index, surface, initial.vertices, allowed, thorough=False, max_moves=max_moves)
        _keep(reached, LocalOptimum(initial, path, index.score(surface, path[-1])))
    refined: dict[tuple[int, ...], LocalOptimum] = {}
    for optimum in _best(reached, keep):
        further = _climb(index, surface, optimum.vertices, allowed, thorough=True, max_moves=max_moves)
        path = np.vstack((optimum.path, further[1:]))
        _keep(refined, LocalOptimum(optimum.initial, path, index.score(surface, path[-1])))
    return _best(refined, keep)


def _climb(
    index: Index, surface: Surface, vertices: IntArray, allowed: BoolArray, *, thorough: bool, max_moves: int
) -> IntArray:
    """Climb by the index's own compiled climb if it has one, else proposal by proposal."""
    compiled = getattr(index, "climb", None)
    if compiled is not None:
        path: IntArray = compiled(surface, vertices, allowed, thorough=thorough, max_moves=max_moves)
        return path
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


def _keep(found: dict[tuple[int, ...], LocalOptimum], optimum: LocalOptimum) -> None:
    """Keep the first of equal sets of contacts."""
    found.setdefault(tuple(sorted(optimum.vertices.tolist())), optimum)


def _best(found: dict[tuple[int, ...], LocalOptimum], keep: int) -> list[LocalOptimum]:
    return sorted(found.values(), key=lambda optimum: -optimum.score)[:keep]
