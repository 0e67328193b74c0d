"""Multi-start on the finished surface: what a local search reaches that may wait for the end."""

from collections.abc import Iterator
from typing import ClassVar

from graspbench.errors import PlanningError
from graspbench.planning.parameters import AnyPlannerParameters, PlannerParameters
from graspbench.planning.planner import PLANNERS, FoundGrasp, PlanningProblem
from graspbench.planning.planners.parallel import best_and_others


@PLANNERS.register("restarted")
class Restarted:
    """Climbs the index from first grasps on the finished surface; see `graspbench.planning.plan_restarted`.

    Args:
        parameters: How to search.
    """

    parameters: ClassVar[type[AnyPlannerParameters]] = PlannerParameters
    climbs_index: ClassVar[bool] = True

    def __init__(self, parameters: PlannerParameters) -> None:
        self._parameters = parameters

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        """Yield the best grasp by the index, then the others that the hand was found to hold."""
        from graspbench.planning.local import plan_restarted  # choosing this planner does not load it

        surfaces = list(problem.surfaces)
        if not surfaces:
            raise PlanningError("there was no surface to plan on", remedy="give at least one snapshot")
        yield from best_and_others(
            plan_restarted(
                surfaces, problem.index, problem.hand, problem.n_f, self._parameters, problem.quality
            )
        )
