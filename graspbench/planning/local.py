"""The local planner: grasp and surface take shape together (thesis 3.4)."""

from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import GraspQuality, QualityParameters
from graspbench.planning.concurrent import ConcurrentSurfaces, TimedSurfaces
from graspbench.planning.constraint import HandConstraint
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp
from graspbench.planning.local_search import LocalSearch
from graspbench.planning.parameters import PlannerParameters
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class LocalPlan:
    """A grasp found by the local planner, and how.

    Attributes:
        grasp: Force closure; its posture is feasible (None when planned without a hand).
        history: The configurations on the way, first to last, one a move and one a surface.
        quality: The grasp's Q1, Q2 and Q3.
        score: What the index thinks of it; the index's own unit.
        initial: The equilateral grasp it began with.
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
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    quality: GraspQuality
    score: float
    initial: InitialGrasp
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


def plan_local(
    surfaces: Iterable[Surface],
    index: Index,
    checker: HandConstraint | None,
    n_f: int,
    planner: PlannerParameters,
    quality: QualityParameters,
) -> LocalPlan:
    """Plan a grasp while the surface shrinks onto the object.

    The first equilateral grasp is moved on every surface until no finger wants to move. Which local optimum
    it ends in depends on how it was turned, so once the surface is at rest further rotations of it, and
    further planes, are moved too. A local optimum that is not force closure, or that the hand cannot hold,
    is never a grasp.

    Args:
        surfaces: Snapshots of the reconstruction, an ellipsoid first, one at rest last; taken lazily.
        index: What the fingers climb.
        checker: The hand; None plans without one.
        n_f: Number of contacts.
        planner: How to search.
        quality: How force closure and quality are measured.

    Raises:
        PlanningError: No rotation ends in a grasp; the message says why.
    """
    started = perf_counter()
    source = ConcurrentSurfaces(surfaces) if planner.mode == "concurrent" else TimedSurfaces(surfaces)
    search = LocalSearch(index, checker, n_f, planner, quality)
    waited = perf_counter()
    waiting = 0.0
    for surface in source:
        waiting += perf_counter() - waited
        search.follow(surface)
        waited = perf_counter()
    waiting += perf_counter() - waited
    best = search.choose()
    finished = perf_counter()
    grasp, history = search.grasps(best)
    return LocalPlan(
        grasp=grasp,
        history=history,
        quality=best.quality,
        score=best.score,
        initial=best.initial,
        rotations_tried=search.tried,
        rejected=dict(search.rejected),
        iterations=search.iterations,
        surfaces_made=source.made,
        moves=sum(follower.moves for follower in search.followers),
        evaluations=sum(follower.evaluations for follower in search.followers),
        contour_queries=search.contour_queries,
        cycles=sum(follower.cycles for follower in search.followers),
        force_closure=True,
        reconstruction_time_s=source.busy_s,
        planning_time_s=finished - started - waiting,
        time_s=finished - started,
    )
