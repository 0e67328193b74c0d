"""Grasps of all qualities on one surface: stratified, the bad ones too."""

from collections.abc import Iterator

import numpy as np

from graspbench.arrays import IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.configuration import Grasp
from graspbench.planning.merit import quality_of
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.planner import PlanningProblem, make_planner, placed_grasp
from graspbench.planning.planners.random_closure import random_contacts
from graspbench.reconstruction.surface import Surface

DRAWS = 4000
"""Sets of contacts from which the strata are made."""

STRATA: dict[str, tuple[float, float]] = {
    "low": (0.0, 0.4),
    "middle": (0.4, 0.75),
    "high": (0.75, 0.95),
    "top": (0.95, 1.0),
}
"""Ranks of Q3 among the force closure draws, 0 the least, 1 the largest."""

PLANNED = "planned"
PER_HAND = 2
"""Strata of which a hand tries a grasp on an object, drawn anew for each: more objects tell more."""

TRIES = 25
"""Draws of a stratum that the hand is asked for, until it holds one."""


def stratified_grasps(
    problem: PlanningProblem, surface: Surface, surfaces: list[Surface], rng: np.random.Generator
) -> Iterator[tuple[str, Grasp]]:
    """Yield grasps with the hand, and which stratum each is of.

    ``open`` is no force closure, though not far from it: its normals oppose each other somewhat. The four
    strata are random draws by their rank in Q3. ``planned`` is the local planner's. `PER_HAND` of these six
    are drawn; one of which the hand holds none is left out.

    Args:
        problem: Hand, friction and measures; its surfaces are not read.
        surface: The finished surface, the hand's obstacle.
        surfaces: All snapshots, for the local planner.
        rng: Draws.
    """
    drawn = random_contacts(problem, surface, rng, DRAWS)
    length_m = problem.quality.torque_length_m(surface.points, surface.centroid)
    q3 = np.atleast_1d(quality_of(surface, drawn, problem.quality, length_m).q3)
    closed = np.flatnonzero(q3 > CLOSURE_TOLERANCE)
    closed = closed[np.argsort(q3[closed], kind="stable")]
    pools: dict[str, IntArray] = {"open": _opposed(surface, drawn, q3)}
    for name, (low, high) in STRATA.items():
        pools[name] = closed[int(low * len(closed)) : int(np.ceil(high * len(closed)))]
    chosen = rng.permutation([*pools, PLANNED])[:PER_HAND].tolist()
    taken: set[int] = set()
    for name, pool in pools.items():
        if name not in chosen:
            continue
        for row in rng.permutation(pool)[:TRIES].tolist():
            if row in taken:
                continue
            grasp = placed_grasp(problem, surface, drawn[row])
            if grasp is not None:
                taken.add(row)
                yield name, grasp
                break
    if PLANNED not in chosen:
        return
    try:
        planned = make_planner("parallel", PlannerParameters()).plan(_with(problem, surfaces))
        yield PLANNED, next(iter(planned)).grasp
    except PlanningError:
        return


def _opposed(surface: Surface, drawn: IntArray, q3: np.ndarray[tuple[int], np.dtype[np.float64]]) -> IntArray:
    """Return rows of draws that are not closed but whose normals nearly add up to nothing."""
    normals = surface.normals[drawn]
    balance = np.linalg.norm(normals.mean(axis=1), axis=1)
    return np.flatnonzero((q3 <= CLOSURE_TOLERANCE) & (balance < 0.45))


def _with(problem: PlanningProblem, surfaces: list[Surface]) -> PlanningProblem:
    return PlanningProblem(
        surfaces,
        problem.hand,
        problem.n_f,
        problem.index,
        problem.quality,
        problem.seed,
        problem.time_limit_s,
    )
