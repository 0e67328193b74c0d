"""One trial, from camera images to an executed grasp: the thesis' block diagram (figure 3.2)."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.experiment.clock import StageClock
from graspbench.experiment.config import TrialConfig
from graspbench.experiment.planned import PlannedTrial, planned_trial
from graspbench.experiment.results import (
    execution_result,
    global_result,
    local_result,
    measures_result,
    object_result,
    ratios,
    reconstruction_result,
    refined_result,
    verified_result,
)
from graspbench.planning import (
    FingertipPath,
    GlobalResult,
    JointPath,
    RefinedGrasp,
    fingertip_paths,
    plan_global,
    refine,
    track,
)
from graspbench.record import TrialLog
from graspbench.simulation.execution_result import ExecutionResult
from graspbench.simulation.grasp_execution import execute_grasp
from graspbench.simulation.tip_friction import tip_friction


def run_trial(
    config: TrialConfig,
    *,
    log: TrialLog | None = None,
    picture_dir: Path | None = None,
    on_stage: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Run one trial.

    Args:
        config: What to run.
        log: Where to record it, stage by stage; None records nothing.
        picture_dir: Where its pictures go; None draws none.
        on_stage: Called with each stage's name and seconds.

    Returns:
        The trial's part of ``result.json``: plain values only.

    Raises:
        InputError: What the configuration names cannot be used.
        TrialError: The trial failed on its way; the message says where and why.
    """
    clock = StageClock(on_stage)
    record = log or TrialLog(Path("unused.mcap"), "off")
    with planned_trial(config, clock) as trial:
        with clock.stage("record"):
            _record_plan(record, trial)
        best = _plan_global(config, trial, clock)
        refined = _refine(config, trial, clock)
        with clock.stage("paths"):
            paths, motion = _plan_paths(config, trial)
        with clock.stage("record"):
            _record_paths(record, trial, best, paths, motion)
        execution = _execute(config, trial, motion, clock)

    with clock.stage("figures_of_merit"):
        result = _result(config, trial, best, refined, execution)
    with clock.stage("record"):
        if execution is not None:
            record.motion(trial.hand.joint_names, execution.motion)
        record.scores(_scores(result))
    if picture_dir is not None and config.record.pictures:
        with clock.stage("pictures"):
            from graspbench.experiment.pictures import draw_trial  # loads Matplotlib

            draw_trial(picture_dir, config.index_name, trial, paths)
    return {**result, "times_s": dict(clock.seconds)}


def _plan_global(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> dict[str, GlobalResult]:
    """Search the finished surface for the best grasp by each measure, under the same constraints."""
    if not config.search.enabled:
        return {}
    found = {}
    for measure in config.search.measures:
        with clock.stage(f"global_{measure}"):
            found[measure] = plan_global(
                trial.surfaces[-1],
                measure,
                config.hand.fingers,
                config.quality,
                config.search,
                checker=trial.checker,
                centre_tolerance_m=_centre_tolerance(config, trial),
                starts=(trial.plan.grasp,),
            )
    return found


def _refine(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> dict[str, RefinedGrasp]:
    """Climb each measure from the local grasp, under the constraints of the global search."""
    if not config.search.refine:
        return {}
    found = {}
    for measure in (measure for measure in config.search.measures if measure != "mirtich_canny"):
        with clock.stage(f"refine_{measure}"):
            found[measure] = refine(
                trial.plan.grasp,
                trial.surfaces[-1],
                measure,
                config.quality,
                checker=trial.checker,
                centre_tolerance_m=_centre_tolerance(config, trial),
                parameters=config.planner.refine,
            )
    return found


def _centre_tolerance(config: TrialConfig, trial: PlannedTrial) -> float | None:
    """Return how far the centre of grip may be from the centroid; None when the index does not ask.

    The search gets at least the freedom that the local grasp took, or the two could not be compared.
    """
    if not getattr(config.index, "k_cm", 0.0) > 0:
        return None
    grasp = trial.plan.grasp
    taken = float(np.linalg.norm(grasp.points.mean(axis=0) - grasp.centroid))
    return max(config.search.centre_tolerance_m, 1.001 * taken)


def _plan_paths(config: TrialConfig, trial: PlannedTrial) -> tuple[tuple[FingertipPath, ...], JointPath]:
    """Plan the fingertips' way to their contacts and the hand's motion along it."""
    planner, posture = config.planner, trial.plan.grasp.posture
    assert posture is not None, "a plan made with a checker has a posture"
    paths = fingertip_paths(trial.plan.history, planner.paths, planner.floating_distance_m, trial.hand)
    return paths, track(paths, trial.hand, posture, planner.paths)


def _execute(
    config: TrialConfig, trial: PlannedTrial, motion: JointPath, clock: StageClock
) -> ExecutionResult | None:
    if trial.scene is None or config.execution.until == "off":
        return None
    with clock.stage("execution"):
        friction = tip_friction(config.execution, config.quality, trial.surfaces[-1])
        return execute_grasp(
            trial.scene.world, trial.hand, trial.plan.grasp, motion, config.execution, friction
        )


def _result(
    config: TrialConfig,
    trial: PlannedTrial,
    best: Mapping[str, GlobalResult],
    refined: Mapping[str, RefinedGrasp],
    execution: ExecutionResult | None,
) -> dict[str, Any]:
    surface, quality = trial.surfaces[-1], config.quality
    local = {
        **local_result(trial.plan),
        **verified_result(trial),
        **measures_result(trial.plan.grasp, surface, quality),
    }
    optima = {
        measure: {**global_result(found), **measures_result(found.grasp, surface, quality)}
        for measure, found in best.items()
    }
    return {
        "success": execution is None or execution.success,
        "object": object_result(trial),
        "local": local,
        "global": optima,
        "ratio": ratios(local, optima),
        "refined": {measure: refined_result(found) for measure, found in refined.items()},
        "reconstruction": reconstruction_result(trial),
        "execution": None if execution is None else execution_result(execution),
    }


def _record_plan(log: TrialLog, trial: PlannedTrial) -> None:
    log.views(trial.views, trial.silhouettes)
    if trial.scene is not None:
        log.object_pose(trial.scene.transform_object_to_world)
    for surface in trial.surfaces:
        log.surface(surface)
    log.grasp(trial.plan.grasp, "local")


def _record_paths(
    log: TrialLog,
    trial: PlannedTrial,
    best: Mapping[str, GlobalResult],
    paths: tuple[FingertipPath, ...],
    motion: JointPath,
) -> None:
    for measure, found in best.items():
        if found.grasp is not None:
            log.grasp(found.grasp, f"global-{measure}")
    log.paths(paths)
    log.joints(trial.hand.joint_names, motion.times, motion.joints, motion.transform_palm_to_world)


def _scores(result: Mapping[str, Any]) -> dict[str, Any]:
    scores: dict[str, Any] = {"success": result["success"]}
    for measure in ("q1", "q2", "q3"):
        scores[f"local.{measure}"] = result["local"][measure]
    for measure, found in result["global"].items():
        scores[f"global.{measure}"] = found["value"]
        scores[f"ratio.{measure}"] = result["ratio"].get(measure)
    return scores
