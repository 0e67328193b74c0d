"""Multi-start on the finished surface: many first grasps climbed without the hand, the best shown to it.

This is no parallel planner: it begins when the surface is at rest. It says what a local search could reach
that may wait for the end, and finds a grasp where no follower has become one.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.judge import Candidate, Judge
from graspbench.planning.screen import polish, screen
from graspbench.planning.settling import Follower
from graspbench.reconstruction.carrying import carry_over
from graspbench.reconstruction.surface import Surface

MAX_TRIES_ONCE_FOUND, MAX_TRIES = 40, 120
"""Local optima of one batch that the hand tries at most: when some are grasps, and when none is."""


def restart(first: Surface, surface: Surface, n_f: int, rotations: int, judge: Judge) -> list[Candidate]:
    """Return grasps reached from first grasps on the finished surface, of the first planes that hold any.

    Args:
        first: The first surface, an ellipsoid: where the first grasps are equilateral.
        surface: The surface at rest.
        n_f: Number of contacts.
        rotations: First grasps in each plane.
        judge: The hand.
    """
    planes = initial_grasps(first, n_f, rotations)
    found: list[Candidate] = []
    while starts := _some(planes, judge.planner.planes):
        _try_best_first(first, surface, starts, judge, found)
        if found:
            break
    return found


def _some(planes: Iterator[tuple[InitialGrasp, ...]], count: int) -> list[InitialGrasp]:
    return [initial for plane in islice(planes, count) for initial in plane]


def _try_best_first(
    first: Surface, surface: Surface, starts: list[InitialGrasp], judge: Judge, found: list[Candidate]
) -> None:
    """Climb first grasps without the hand, then let the hand try the best local optima."""
    planner, index = judge.planner, judge.index
    allowed = judge.allowed(surface)
    starts = [replace(start, vertices=carry_over(start.vertices, first, surface)) for start in starts]
    optima = screen(index, surface, starts, allowed, planner.max_moves)
    before_all, tried_before = len(judge.followers), judge.tried
    seen: set[tuple[int, ...]] = set()
    ends = np.array([optimum.vertices for optimum in optima], dtype=np.int64)
    for rank, promise in judge.ranked(surface, ends.reshape(len(optima), len(starts[0].vertices))):
        most = MAX_TRIES_ONCE_FOUND if found else MAX_TRIES
        if judge.enough(found, promise) or len(judge.followers) - before_all >= most:
            break
        rough, before = optima[rank], len(found)
        for optimum in (polish(index, surface, rough, allowed, planner.max_moves), rough):
            # Where the hand cannot hold the better one, the other may still do.
            if optimum.contacts not in seen and len(found) == before:
                seen.add(optimum.contacts)
                path = list(optimum.path)
                follower = Follower(path[-1], moves=len(path) - 1, evaluations=len(path))
                follower.via.append((first, carry_over(path[0], surface, first)))
                follower.via.extend((surface, vertices) for vertices in path)
                judge.settle(follower, optimum.initial, surface, found)
    judge.tried = tried_before + len(starts)
