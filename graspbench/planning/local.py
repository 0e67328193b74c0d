"""The local planner: grasp and surface take shape together (thesis 3.4)."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from time import perf_counter
from typing import Literal

import numpy as np

from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import GraspQuality, QualityParameters
from graspbench.planning.concurrent import ConcurrentSurfaces, TimedSurfaces
from graspbench.planning.constraint import HandConstraint
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp
from graspbench.planning.judge import Candidate, Judge, route
from graspbench.planning.on_surface import grasp_at
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.population import Population
from graspbench.planning.progress import PlanningStep, formed_shares
from graspbench.planning.restart import restart
from graspbench.planning.settling import Follower
from graspbench.planning.single_follower import SingleFollower
from graspbench.reconstruction.carrying import carry_over
from graspbench.reconstruction.surface import Surface

FoundBy = Literal["follower", "restart"]

_CLOSER_LOOK = 3  # times as many rotations, before a search is given up


@dataclass(frozen=True)
class StepQuality:
    """How good the planner's best grasp was at one step of the surface.

    Attributes:
        formed: How much of the way to the finished surface its nodes had gone, 0 to 1.
        followers: Grasps that followed the surface then.
        score: What the index thought of the best one there.
        quality: Q1, Q2 and Q3 that the same nodes have on the finished surface; not held by the hand, maybe.
    """

    formed: float
    followers: int
    score: float
    quality: GraspQuality


@dataclass(frozen=True)
class LocalPlan:
    """A grasp found by the local planner, and how.

    Attributes:
        grasp: Force closure; its posture is feasible (None when planned without a hand).
        history: The configurations on the way, first to last, one a move and one a surface.
        quality: The grasp's Q1, Q2 and Q3.
        score: What the index thinks of it; the index's own unit.
        initial: The equilateral grasp it began with.
        found_by: "follower": it followed the surface while it formed. "restart": it was found from new first
            grasps on the finished surface.
        followed_share: Share of its contacts that were the follower's before the surface came to rest.
        polish_mm: Mean distance of its contacts from where the follower was then, on the finished surface.
        rotations_tried: First grasps that were followed to a local optimum.
        rejected: Why local optima were not grasps: how often each reason came up.
        iterations: Surfaces that were planned on.
        surfaces_made: Surfaces that were made.
        moves: Moves of all tried grasps.
        evaluations: Proposals asked from the index.
        contour_queries: Inverse kinematics of fingers at contour points.
        cycles: Times an index wanted back to a configuration it had left.
        force_closure: Always True: nothing else is called a grasp.
        reconstruction_time_s: Time of the reconstruction alone.
        planning_time_s: Time of the planner alone.
        time_s: Time of both together, as waited for.
        others: Further grasps that the hand holds, the best first, and what the index thinks of each.
        measure_steps: Measures what ``steps`` tells.
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    quality: GraspQuality
    score: float
    initial: InitialGrasp
    found_by: FoundBy
    followed_share: float
    polish_mm: float
    rotations_tried: int
    rejected: dict[str, int]
    iterations: int
    surfaces_made: int
    moves: int
    evaluations: int
    contour_queries: int
    cycles: int
    force_closure: bool
    reconstruction_time_s: float
    planning_time_s: float
    time_s: float
    others: tuple[tuple[Grasp, float], ...]
    measure_steps: Callable[[], tuple[StepQuality, ...]] = field(repr=False, compare=False)

    @cached_property
    def steps(self) -> tuple[StepQuality, ...]:
        """How good the best grasp was at every step of the surface; measured when first asked for."""
        return self.measure_steps()


def plan_local(
    surfaces: Iterable[Surface],
    index: Index,
    checker: HandConstraint | None,
    n_f: int,
    planner: PlannerParameters,
    quality: QualityParameters,
) -> LocalPlan:
    """Plan a grasp while the surface shrinks onto the object.

    Grasps move on every surface until no finger wants to move: a population of them, or one alone
    (``planner.followers=1``, the thesis). What has followed when the surface comes to rest is polished
    there. A local optimum that is not force closure, or that the hand cannot hold, is never a grasp. Where no
    follower has become a grasp, first grasps are tried anew on the finished surface; the plan says so.

    Args:
        surfaces: Snapshots of the reconstruction, an ellipsoid first, one at rest last; taken lazily.
        index: What the fingers climb.
        checker: The hand; None plans without one.
        n_f: Number of contacts.
        planner: How to search.
        quality: How force closure and quality are measured.

    Raises:
        PlanningError: Nothing found is a grasp; the message says why.
    """
    started = perf_counter()
    source = ConcurrentSurfaces(surfaces) if planner.mode == "concurrent" else TimedSurfaces(surfaces)
    judge = Judge(index, checker, planner, quality)
    single = planner.followers == 1 or planner.select == "first"
    search = SingleFollower(judge, n_f) if single else Population(judge, n_f)
    first: Surface | None = None
    waited, waiting = perf_counter(), 0.0
    for surface in source:
        waiting += perf_counter() - waited
        first = first or surface
        search.follow(surface)
        waited = perf_counter()
    waiting += perf_counter() - waited
    if first is None:
        raise PlanningError("there was no surface to plan on", remedy="give at least one snapshot")
    found = search.choose()
    found_by: FoundBy = "follower"
    if not found and planner.select != "first":
        found, found_by = _from_anew(first, surface, n_f, judge, planner.rotations), "restart"
    if not found:
        raise judge.failure(n_f)
    finished = perf_counter()
    return _plan(
        found, surface, judge, search.steps, found_by,
        moves=search.moves, evaluations=search.evaluations, surfaces_made=source.made,
        times_s=(source.busy_s, finished - started - waiting, finished - started),
    )  # fmt: skip


def plan_restarted(
    surfaces: Sequence[Surface],
    index: Index,
    checker: HandConstraint | None,
    n_f: int,
    planner: PlannerParameters,
    quality: QualityParameters,
) -> LocalPlan:
    """Plan a grasp by multi-start on the finished surface; nothing follows the surface while it forms.

    Args:
        surfaces: Snapshots of the reconstruction, an ellipsoid first, one at rest last.
        index: What the fingers climb.
        checker: The hand; None plans without one.
        n_f: Number of contacts.
        planner: How to search.
        quality: How force closure and quality are measured.

    Raises:
        PlanningError: Nothing found is a grasp; the message says why.
    """
    started = perf_counter()
    judge = Judge(index, checker, planner, quality)
    judge.see(surfaces[-1])
    found = _from_anew(surfaces[0], surfaces[-1], n_f, judge, planner.rotations)
    if not found:
        raise judge.failure(n_f)
    spent = perf_counter() - started
    return _plan(
        found, surfaces[-1], judge, [], "restart",
        moves=0, evaluations=0, surfaces_made=len(surfaces), times_s=(0.0, spent, spent),
    )  # fmt: skip


def _from_anew(first: Surface, last: Surface, n_f: int, judge: Judge, rotations: int) -> list[Candidate]:
    """Try first grasps on the finished surface, the best one first; look closer before giving up."""
    found = restart(first, last, n_f, rotations, judge)
    found = found or restart(first, last, n_f, _CLOSER_LOOK * rotations, judge)
    return judge.best_first(found)


def _plan(
    found: Sequence[Candidate],
    last: Surface,
    judge: Judge,
    steps: Sequence[PlanningStep],
    found_by: FoundBy,
    *,
    moves: int,
    evaluations: int,
    surfaces_made: int,
    times_s: tuple[float, float, float],
) -> LocalPlan:
    best, *others = found
    grasp, history = route(best.follower, last)
    share, polish_mm = _followed(best.follower, last) if found_by == "follower" else (0.0, 0.0)
    return LocalPlan(
        grasp=grasp,
        history=history,
        quality=best.quality,
        score=best.score,
        initial=best.initial,
        found_by=found_by,
        followed_share=share,
        polish_mm=polish_mm,
        rotations_tried=judge.tried,
        rejected=dict(judge.rejected),
        iterations=len(steps),
        surfaces_made=surfaces_made,
        moves=moves + sum(follower.moves for follower in judge.followers),
        evaluations=evaluations + sum(follower.evaluations for follower in judge.followers),
        contour_queries=judge.contour_queries,
        cycles=sum(follower.cycles for follower in judge.followers),
        force_closure=True,
        reconstruction_time_s=times_s[0],
        planning_time_s=times_s[1],
        time_s=times_s[2],
        others=tuple(
            (grasp_at(last, each.follower.vertices, each.follower.posture), each.score) for each in others
        ),
        measure_steps=partial(_step_qualities, list(steps), last, judge),
    )


def _followed(follower: Follower, last: Surface) -> tuple[float, float]:
    """Return which share of the contacts was there before the surface rested, and how far off all were."""
    before = follower.followed
    if before is None:
        return 0.0, 0.0
    apart = np.linalg.norm(last.points[before] - last.points[follower.vertices], axis=1)
    return float(np.mean(before == follower.vertices)), 1e3 * float(apart.mean())


def _step_qualities(steps: list[PlanningStep], last: Surface, judge: Judge) -> tuple[StepQuality, ...]:
    if not steps:
        return ()
    grasps = np.stack([carry_over(step.vertices, step.surface, last) for step in steps])
    different, which = np.unique(grasps, axis=0, return_inverse=True)
    qualities = judge.qualities_on(last, different)
    return tuple(
        StepQuality(float(formed), step.followers, step.score, qualities[rank])
        for formed, step, rank in zip(formed_shares(steps), steps, which.ravel().tolist(), strict=True)
    )
