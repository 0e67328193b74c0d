"""One trial, from camera images to an executed grasp: the thesis' block diagram (figure 3.2)."""

import dataclasses
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from graspbench.beside import Beside
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import TrialError
from graspbench.planning import GlobalResult, LocalPlan, RefinedGrasp
from graspbench.record import TrialLog
from graspbench.results.physical_results import ExecutedResult
from graspbench.results.trial_result import TrialResult
from graspbench.simulation.execution_result import ExecutionResult
from graspbench.simulation.exploration import FeltParts
from graspbench.simulation.grasp_execution import execute_grasp
from graspbench.simulation.tip_friction import tip_friction
from graspbench.trial.clock import StageClock
from graspbench.trial.evidence import Evidence
from graspbench.trial.exploring import explored
from graspbench.trial.felt import felt_result, shift_unseen, true_q3
from graspbench.trial.outcome import (
    execution_result,
    explored_result,
    global_results,
    local_result,
    object_result,
    planned_result,
    ratios,
    reconstruction_result,
    refined_results,
    restarted_result,
    strengthened_result,
)
from graspbench.trial.planned import PlannedTrial, film, planned_trial
from graspbench.trial.planned_pictures import planned_pictures
from graspbench.trial.reaching import Way, way_to_grasp
from graspbench.trial.recording import grasp_scores, record_paths, record_plan
from graspbench.trial.searching import global_grasps, refined_grasps, restarted_plan
from graspbench.trial.strengthening import strengthened

_DRAWN = ".drawn"
"""Folder of pictures that are being drawn: they count when the trial comes to its end."""


def run_grasp(
    config: TrialConfig,
    started: TrialResult,
    log: TrialLog,
    folder: Path | None,
    clock: StageClock,
    beside: Beside,
) -> TrialResult:
    """Run one trial: the procedure of kind ``trial``.

    Args:
        config: What to run.
        started: What is known of the trial before anything came of it.
        log: Where to record it, stage by stage.
        folder: Where its pictures go; None draws none.
        clock: Times the stages.
        beside: Draws while the grasp is executed.

    Raises:
        InputError: What the configuration names cannot be used.
        TrialError: The trial failed on its way; the message says where and why.
    """
    with _drawing(beside, folder):
        evidence = Evidence()
        with _pictured(config, evidence, folder, clock), planned_trial(config, clock, evidence) as trial:
            drawn = folder / _DRAWN if folder is not None and config.record.pictures else None
            if drawn is not None:
                beside.start("draw_seen", evidence, drawn, config.record)
            trial = strengthened(config, trial, clock)
            with clock.stage("record"):
                record_plan(log, trial)
            restarted = restarted_plan(config, trial, clock)
            refined = refined_grasps(config, trial, restarted, clock)
            best = global_grasps(config, trial, restarted, refined, clock)
            if trial.scene is not None:
                shift_unseen(trial.scene.world, config.scene, config.seed)
            trial = explored(config, trial, best, clock)
            way = way_to_grasp(config, trial, clock)
            trial = way.trial
            with clock.stage("record"):
                record_paths(log, trial, best, way.paths, way.motion)
            if drawn is not None:
                shown = planned_pictures(trial, way.paths, config.index_name, config.record)
                beside.start("draw_planned", shown, drawn)
            execution = _execute(config, way, clock)

        result = clock.run(
            "figures_of_merit", partial(_result, config, started, trial, restarted, best, refined, execution)
        )
        with clock.stage("record"):
            if execution is not None:
                if execution.explored is not None:
                    log.felt(execution.explored.felt)
                log.motion(trial.hand.joint_names, execution.motion)
            log.scores(grasp_scores(result))
        if folder is not None and execution is not None:
            film(config, trial, execution.motion, folder, clock)
        if folder is not None and config.record.pictures:
            _finish_pictures(config, trial, execution, folder, clock, beside)
        return result


@contextmanager
def _drawing(beside: Beside, folder: Path | None) -> Iterator[None]:
    """Leave no half-drawn picture behind, whatever becomes of the trial."""
    try:
        yield
    finally:
        beside.stop()  # it may be writing them
        if folder is not None:
            shutil.rmtree(folder / _DRAWN, ignore_errors=True)


@contextmanager
def _pictured(
    config: TrialConfig, evidence: Evidence, folder: Path | None, clock: StageClock
) -> Iterator[None]:
    """Draw what there is when a trial fails inside the block."""
    try:
        yield
    except TrialError:
        if folder is not None and config.record.pictures:
            with clock.stage("pictures"):
                from graspbench.trial.pictures import draw_evidence  # loads Matplotlib

                draw_evidence(folder, evidence, config.record)
        raise


def _finish_pictures(
    config: TrialConfig,
    trial: PlannedTrial,
    execution: ExecutionResult | None,
    folder: Path,
    clock: StageClock,
    beside: Beside,
) -> None:
    """Take the pictures over, and draw how the object was lost, if it was."""
    with clock.watch.at("pictures"):
        drawing, compiling = zip(*beside.results(), strict=True)
        clock.add_compiled("pictures", sum(drawing), sum(compiling))
    for path in sorted((folder / _DRAWN).iterdir()):
        path.rename(folder / path.name)
    if execution is not None and execution.reason is not None:
        with clock.stage("pictures"):
            from graspbench.trial.pictures import draw_failure  # loads Matplotlib

            draw_failure(folder, trial, execution, config.record)


def _execute(config: TrialConfig, way: Way, clock: StageClock) -> ExecutionResult | None:
    trial, motion = way.trial, way.motion
    if trial.scene is None or config.execution.until == "off":
        return None
    with clock.stage("execution"):
        friction = tip_friction(config.execution, config.quality, trial.surfaces[-1])
        ride = None if trial.followed is None else trial.followed.begin()
        return execute_grasp(
            trial.scene.world,
            trial.hand,
            trial.executed.grasp,
            motion,
            config.execution,
            friction,
            ride,
            FeltParts(trial.surfaces[-1], motion.closing),
            way.carrier,
        )


def _result(
    config: TrialConfig,
    started: TrialResult,
    trial: PlannedTrial,
    restarted: LocalPlan | None,
    best: Mapping[str, GlobalResult],
    refined: Mapping[str, RefinedGrasp],
    execution: ExecutionResult | None,
) -> TrialResult:
    surface, quality = trial.surfaces[-1], config.quality
    local, optima = local_result(trial, quality, config.search), global_results(best, surface, quality)
    return dataclasses.replace(
        started,
        success=None if execution is None else execution.success,
        object=object_result(trial),
        planned=planned_result(config.planner_name, trial.plan),
        strengthened=strengthened_result(trial, quality),
        explored=explored_result(trial),
        local=local,
        restarted=None if restarted is None else restarted_result(restarted),
        global_=optima,
        ratio=ratios(local, optima),
        refined=refined_results(refined),
        moving=None if trial.followed is None else trial.followed.result(config.scene.motion),
        reconstruction=reconstruction_result(trial),
        execution=None if execution is None else _executed(config, trial, execution),
    )


def _executed(config: TrialConfig, trial: PlannedTrial, execution: ExecutionResult) -> ExecutedResult:
    """Return what came of the execution, with what was felt and how good the real contacts were."""
    assert trial.scene is not None, "what was executed was simulated"
    return dataclasses.replace(
        execution_result(execution),
        true_q3=true_q3(trial.scene.model, execution, config.quality, trial.surfaces[-1]),
        touch=felt_result(trial.scene, trial.surfaces[-1], execution),
    )
