"""A planner at work: what it yields is checked, timed, and the best of it is the plan."""

from collections import Counter
from dataclasses import dataclass, replace
from time import perf_counter

from graspbench.errors import PlanningError
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import GraspQuality
from graspbench.planning.concurrent import TimedSurfaces
from graspbench.planning.judge import NOT_CLOSED
from graspbench.planning.local import LocalPlan
from graspbench.planning.merit import quality_of
from graspbench.planning.planner import FoundGrasp, Planner, PlanningProblem
from graspbench.reconstruction.surface import Surface

NO_POSTURE = "no posture was given"


@dataclass(frozen=True, eq=False)
class TimedGrasp:
    """A grasp that passed the checks, and when it came.

    Attributes:
        found: What the planner yielded.
        quality: Its Q1, Q2 and Q3, measured here.
        time_s: Seconds since planning began, the reconstruction included.
    """

    found: FoundGrasp
    quality: GraspQuality
    time_s: float


@dataclass(frozen=True, eq=False)
class Plan:
    """What a planner found.

    Attributes:
        grasp: The best grasp by the planner's own score.
        history: Configurations that led to it, the grasp last.
        quality: Its Q1, Q2 and Q3.
        score: What the planner thinks of it; the planner's own unit.
        found: Every grasp that passed, in the order of coming.
        rejected: Why others did not, and how often.
        force_closure: Always True: nothing else is called a grasp.
        first_s: When the first grasp came, since planning began, the reconstruction included.
        best_s: When the best one came.
        reconstruction_time_s: Time of the reconstruction alone.
        planning_time_s: Time of the planner alone.
        time_s: Time of both together, as waited for.
        details: How the local planner found it; None where another planner did.
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    quality: GraspQuality
    score: float
    found: tuple[TimedGrasp, ...]
    rejected: dict[str, int]
    force_closure: bool
    first_s: float
    best_s: float
    reconstruction_time_s: float
    planning_time_s: float
    time_s: float
    details: LocalPlan | None


def plan_with(planner: Planner, problem: PlanningProblem) -> Plan:
    """Let a planner plan until it ends or its time is up, and keep what is a grasp.

    Args:
        planner: The planner.
        problem: What it may see; the clock starts now.

    Raises:
        PlanningError: Nothing that it yielded is a grasp; the message says why.
    """
    watched = TimedSurfaces(problem.surfaces)
    problem = replace(problem, surfaces=watched, started_s=perf_counter())
    found: list[TimedGrasp] = []
    rejected: Counter[str] = Counter()
    gave_up: PlanningError | None = None
    try:
        for each in planner.plan(problem):
            passed = perf_counter() - problem.started_s
            fault, quality = _checked(each, watched.last, problem)
            if fault is not None:
                rejected[fault] += 1
            else:
                found.append(TimedGrasp(each, quality, passed))
            if problem.time_left_s() <= 0.0:
                break
    except PlanningError as error:
        gave_up = error
    time_s = perf_counter() - problem.started_s
    if not found:
        raise gave_up or _nothing(rejected, problem)
    best = max(found, key=lambda timed: timed.found.score)
    details = best.found.details
    times_s = (watched.busy_s, time_s - watched.busy_s)
    if details is not None:  # reconstruction and planning may have gone on at the same time
        times_s = details.reconstruction_time_s, details.planning_time_s
        rejected.update(details.rejected)
    return Plan(
        grasp=best.found.grasp,
        history=(*best.found.history, best.found.grasp),
        quality=best.quality,
        score=best.found.score,
        found=tuple(found),
        rejected=dict(rejected),
        force_closure=True,
        first_s=found[0].time_s,
        best_s=best.time_s,
        reconstruction_time_s=times_s[0],
        planning_time_s=times_s[1],
        time_s=time_s,
        details=details,
    )


def _checked(
    each: FoundGrasp, surface: Surface | None, problem: PlanningProblem
) -> tuple[str | None, GraspQuality]:
    """Return what is wrong with a grasp, None if nothing is, and its quality."""
    assert surface is not None, "a grasp was found without a surface"
    quality = problem.quality
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    measured = quality_of(surface, each.grasp.vertices, quality, length_m)
    if problem.hand is not None and each.grasp.posture is None:
        return NO_POSTURE, measured
    # The origin is inside the grasp wrench space exactly when a ball around it is.
    return (NOT_CLOSED if measured.q3 <= CLOSURE_TOLERANCE else None), measured


def _nothing(rejected: Counter[str], problem: PlanningProblem) -> PlanningError:
    why = ", ".join(f"{reason} ({count} times)" for reason, count in rejected.most_common(3))
    return PlanningError(
        f"the planner found no grasp of {problem.n_f} fingers: {why or 'it yielded none'}",
        remedy="try another planner, another hand, more fingers or a larger planner.time_limit_s",
        reasons=dict(rejected),
    )
