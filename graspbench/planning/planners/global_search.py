"""The best of all grasps on the finished surface, as a planner (thesis 3.6, serial approach)."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.planning.parameters import AnyPlannerParameters
from graspbench.planning.planner import PLANNERS, FoundGrasp, PlanningProblem
from graspbench.planning.search.parameters import GlobalMeasure, SearchParameters


@dataclass(frozen=True)
class GlobalPlannerParameters(AnyPlannerParameters):
    """How the finished surface is searched."""

    measure: Annotated[GlobalMeasure, Field(description="Measure whose best grasp is planned")] = "q3"
    gap: Annotated[float, Field(ge=0, lt=1, description="Relative gap at which the search may stop")] = 0.02
    threads: Annotated[int, Field(ge=0, le=64, description="Threads; 0: as many as there are cores")] = 0


@PLANNERS.register("global")
class GlobalPlanner:
    """Searches the finished surface by one measure, with a bound; see `graspbench.planning.plan_global`.

    Args:
        parameters: Measure and limits.
    """

    parameters: ClassVar[type[AnyPlannerParameters]] = GlobalPlannerParameters
    climbs_index: ClassVar[bool] = False

    def __init__(self, parameters: GlobalPlannerParameters) -> None:
        self._parameters = parameters

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        """Yield the best grasp, once the search is over or the time is up."""
        from graspbench.planning.global_search import plan_global  # choosing this planner does not load it

        p, surface = self._parameters, problem.finished_surface()
        limits = SearchParameters(
            time_limit_s=max(problem.time_left_s(), 0.1), gap=p.gap, threads=p.threads, measures=(p.measure,)
        )
        best = plan_global(surface, p.measure, problem.n_f, problem.quality, limits, checker=problem.hand)
        if best.grasp is not None:
            yield FoundGrasp(best.grasp, best.value)
