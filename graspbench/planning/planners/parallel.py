"""The thesis' planner: grasps move by an index while the surface forms (3.4)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

from graspbench.planning.parameters import AnyPlannerParameters, PlannerParameters
from graspbench.planning.planner import PLANNERS, FoundGrasp, PlanningProblem

if TYPE_CHECKING:
    from graspbench.planning.local import LocalPlan


@PLANNERS.register("parallel")
class Parallel:
    """Follows the surface with a population of grasps; see `graspbench.planning.plan_local`.

    Args:
        parameters: How to search.
    """

    parameters: ClassVar[type[AnyPlannerParameters]] = PlannerParameters
    climbs_index: ClassVar[bool] = True

    def __init__(self, parameters: PlannerParameters) -> None:
        self._parameters = parameters

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        """Yield the best grasp by the index, then the others that the hand was found to hold."""
        from graspbench.planning.local import plan_local  # choosing this planner does not load it

        yield from best_and_others(
            plan_local(
                problem.surfaces,
                problem.index,
                problem.hand,
                problem.n_f,
                self._parameters,
                problem.quality,
            )
        )


def best_and_others(plan: "LocalPlan") -> Iterator[FoundGrasp]:
    """Yield a local plan's grasp with the way to it, then the other grasps of the same search.

    What was selected stays the best: the others' scores are cut to its own.
    """
    yield FoundGrasp(plan.grasp, plan.score, plan.history[:-1], plan)
    yield from (FoundGrasp(grasp, min(score, plan.score)) for grasp, score in plan.others)
