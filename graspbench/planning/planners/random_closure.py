"""A baseline: contacts drawn at random until some are force closure and the hand reaches them.

Nothing is optimised. The best of a few grasps by Q3 is kept, as benchmarks that sample antipodal or force
closure contacts do (Nguyen 1988; Borst, Fischer and Hirzinger 2003: random grasps are often good enough).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.planning.merit import quality_of
from graspbench.planning.parameters import AnyPlannerParameters
from graspbench.planning.planner import PLANNERS, FoundGrasp, PlanningProblem, placed_grasp
from graspbench.reconstruction.surface import Surface

BATCH = 256
"""Grasps whose closure is tested at once."""


@dataclass(frozen=True)
class RandomClosureParameters(AnyPlannerParameters):
    """How long contacts are drawn."""

    grasps: Annotated[int, Field(ge=1, description="Grasps that the hand holds, to choose from by Q3")] = 8
    draws: Annotated[int, Field(ge=1, description="Sets of contacts that are drawn before giving up")] = (
        50_000
    )


@PLANNERS.register("random_closure")
class RandomClosure:
    """Yields random force closure grasps that the hand holds, in the order of being drawn.

    Args:
        parameters: How long to draw.
    """

    parameters: ClassVar[type[AnyPlannerParameters]] = RandomClosureParameters
    climbs_index: ClassVar[bool] = False

    def __init__(self, parameters: RandomClosureParameters) -> None:
        self._parameters = parameters

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        """Draw, test, let the hand try; the score is Q3."""
        surface, left = problem.finished_surface(), self._parameters.grasps
        for vertices, q3 in closed_draws(problem, surface, self._parameters.draws):
            if left == 0 or problem.time_left_s() <= 0.0:
                return
            grasp = placed_grasp(problem, surface, vertices)
            if grasp is not None:
                left -= 1
                yield FoundGrasp(grasp, q3)


def closed_draws(problem: PlanningProblem, surface: Surface, draws: int) -> Iterator[tuple[IntArray, float]]:
    """Yield random contacts that are force closure and within the hand's span, with their Q3.

    Args:
        problem: The hand, the contact model, the seed.
        surface: The finished surface.
        draws: Sets of contacts to draw.
    """
    rng, quality = problem.rng(), problem.quality
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    for _ in range(-(-draws // BATCH)):
        drawn = random_contacts(problem, surface, rng, BATCH)
        if not len(drawn):
            continue
        q3 = np.atleast_1d(quality_of(surface, drawn, quality, length_m).q3)
        for row in np.flatnonzero(q3 > CLOSURE_TOLERANCE):
            yield drawn[row], float(q3[row])


def random_contacts(
    problem: PlanningProblem, surface: Surface, rng: np.random.Generator, count: int
) -> IntArray:
    """Return random sets of different nodes that fingertips can touch, no farther apart than the hand spans.

    Args:
        problem: The hand.
        surface: The finished surface.
        rng: Draws.
        count: Sets to draw; those too wide are left out.

    Returns:
        Shape (m, n_f), m at most ``count``.
    """
    hand, n_f = problem.hand, problem.n_f
    usable = np.arange(len(surface.points))
    if hand is not None:
        usable = np.flatnonzero(hand.vertex_mask(surface.points, surface.normals))
    if len(usable) < n_f:
        return np.empty((0, n_f), dtype=np.int64)
    drawn: IntArray = usable[rng.integers(len(usable), size=(count, n_f))]
    ordered = np.sort(drawn, axis=1)
    keep = np.all(ordered[:, 1:] != ordered[:, :-1], axis=1)
    if hand is not None:
        keep &= _spread_m(surface.points[drawn]) <= hand.pair_limit_m
    return drawn[keep]


def _spread_m(points: FloatArray) -> FloatArray:
    """Return the largest distance of two points of each set, shape (m, n_f, 3)."""
    gaps = np.linalg.norm(points[:, :, None] - points[:, None], axis=-1)
    return np.asarray(gaps.max(axis=(1, 2)))
