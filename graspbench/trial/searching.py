"""What a local grasp is compared with: a multi-start, climbs of the measures, the global search."""

from collections.abc import Mapping
from functools import partial

from graspbench.config.trial_config import TrialConfig
from graspbench.grasp import Grasp
from graspbench.planning import (
    GlobalResult,
    LocalPlan,
    Plan,
    PlannerParameters,
    RefinedGrasp,
    make_index,
    plan_global,
    plan_restarted,
    refine,
)
from graspbench.trial.clock import StageClock
from graspbench.trial.planned import PlannedTrial, centre_tolerance_m


def restarted_plan(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> LocalPlan | None:
    """Plan by multi-start on the finished surface, if that is asked for."""
    planner = config.planner
    if not isinstance(planner, PlannerParameters) or not planner.restart:
        return None
    fingers, quality = config.hand.fingers, config.quality
    index = make_index(config.index_name, config.index, fingers, quality)
    return clock.run(
        "restart",
        partial(plan_restarted, trial.surfaces, index, trial.checker, fingers, planner, quality),
    )


def refined_grasps(
    config: TrialConfig, trial: PlannedTrial, restarted: LocalPlan | None, clock: StageClock
) -> dict[str, RefinedGrasp]:
    """Climb each measure from the local grasp, under the constraints of the global search."""
    if not config.search.refine:
        return {}

    def climb(measure: str) -> RefinedGrasp:
        return refine(
            trial.plan.grasp,
            trial.surfaces[-1],
            measure,
            config.quality,
            checker=trial.checker,
            centre_tolerance_m=_centre_tolerance(config, trial, restarted),
            parameters=config.planner.refine,
        )

    return {
        measure: clock.run(f"refine_{measure}", partial(climb, measure))
        for measure in config.search.measures
        if measure != "mirtich_canny"
    }


def global_grasps(
    config: TrialConfig,
    trial: PlannedTrial,
    restarted: LocalPlan | None,
    refined: Mapping[str, RefinedGrasp],
    clock: StageClock,
) -> dict[str, GlobalResult]:
    """Search the finished surface for the best grasp by each measure, under the same constraints.

    The search begins with all grasps that are known, so none of them is better than its bound.
    """
    if not config.search.enabled:
        return {}

    def search(measure: str) -> GlobalResult:
        return plan_global(
            trial.surfaces[-1],
            measure,
            config.hand.fingers,
            config.quality,
            config.search,
            checker=trial.checker,
            centre_tolerance_m=_centre_tolerance(config, trial, restarted),
            starts=_known(trial.plan, restarted, *refined.values()),
            on_begin=clock.watch.follow,
        )

    return {
        measure: clock.run(f"global_{measure}", partial(search, measure))
        for measure in config.search.measures
    }


def _known(*found: Plan | LocalPlan | RefinedGrasp | None) -> tuple[Grasp, ...]:
    return tuple(each.grasp for each in found if each is not None)


def _centre_tolerance(config: TrialConfig, trial: PlannedTrial, restarted: LocalPlan | None) -> float | None:
    return centre_tolerance_m(config, _known(trial.plan, restarted))
