"""In-hand manipulation: a trial up to its grasp, then the motion of the object."""

import csv
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspbench.beside import Beside
from graspbench.config.trial_config import ManipulationConfig, TrialConfig
from graspbench.manipulation import (
    ContactParameters,
    GaitResult,
    ManipulationResult,
    check_gait,
    check_sliding,
    manipulate_object,
)
from graspbench.manipulation.held_object import hold_object
from graspbench.manipulation.reach import RangeEntry, reachable_range
from graspbench.record import TrialLog
from graspbench.results.physical_results import GaitFigures, ManipulationSummary, SlidingFigures
from graspbench.results.trial_result import TrialResult
from graspbench.trial.clock import StageClock
from graspbench.trial.gait_start import gait_with_start
from graspbench.trial.outcome import (
    local_result,
    object_result,
    planned_result,
    strengthened_result,
)
from graspbench.trial.planned import PlannedTrial, film, planned_trial
from graspbench.trial.playing import lost_in_physics, play_motion, played_result
from graspbench.trial.recording import in_hand_scores, record_grasps, record_in_hand

if TYPE_CHECKING:
    from graspbench.simulation.in_hand import InHandResult

RANGE_FILE = "range.csv"


def run_in_hand(
    config: TrialConfig,
    started: TrialResult,
    log: TrialLog,
    folder: Path | None,
    clock: StageClock,
    _beside: Beside,
) -> TrialResult:
    """Plan a grasp and move the object in the hand: the procedure of kind ``manipulation``.

    Args:
        config: The trial, the inverse kinematics, the motion and the contacts.
        started: What is known of the trial before anything came of it.
        log: Where to record it, stage by stage.
        folder: Where histories and pictures go; None writes none.
        clock: Times the stages.
        _beside: Not needed: the pictures show how the motion ended.

    Returns:
        The result; status "failed" with the reason when the motion is not what was asked for.

    Raises:
        InputError: What the user gave cannot be used.
        TrialError: There is no grasp, or the motion cannot go on.
    """
    assert isinstance(config, ManipulationConfig), "the kind says so"
    with planned_trial(config, clock) as planned:
        contact = config.contact
        if contact.mass_kg is None and planned.scene is not None:
            contact = dataclasses.replace(contact, mass_kg=planned.scene.model.mass_kg)
        if config.motion.map_range and folder is not None:
            with clock.stage("range"):
                _write_range(config, planned, folder)
        trial, moved = clock.run("manipulation", lambda: _move(config, planned, contact))
        checked = None
        if isinstance(moved, GaitResult):
            checked = clock.run("check", lambda: _check(config, trial, contact, moved))
        slid = None
        if moved.sliding is not None:
            slid = clock.run("check", lambda: _check_sliding(config, trial, contact, moved))
        reason = _wrong(checked, slid)
        played = None if reason else play_motion(config, trial, moved, clock)
        lost = None if played is None else lost_in_physics(config, played)
        if lost is not None:
            reason = f"played in physics: {lost}"
        result = dataclasses.replace(
            started,
            status="failed" if reason else "done",
            reason=reason,
            success=reason is None,
            object=object_result(trial),
            planned=planned_result(config.planner_name, trial.plan),
            local=local_result(trial),
            strengthened=strengthened_result(trial, config.quality),
            manipulation=ManipulationSummary(**_typed(moved.summary())),
            gait=checked,
            sliding=slid,
            in_hand=None if played is None else played_result(played, config.execution.push_slip_m),
        )
        with clock.stage("record"):
            if played is None:
                record_in_hand(log, trial, moved)
            else:
                record_grasps(log, trial)
                log.motion(trial.hand.joint_names, played.motion)
            log.scores(in_hand_scores(result))
    if folder is not None and played is not None:
        film(config, trial, played.motion, folder, clock)
    if folder is not None:
        with clock.stage("pictures"):
            _draw(config, trial, moved, played, folder)
    return result


def _move(
    config: ManipulationConfig, trial: PlannedTrial, contact: ContactParameters
) -> tuple[PlannedTrial, ManipulationResult]:
    """Plan the motion, by finger gaiting if that is asked for; a gait may start from another grasp."""
    if config.motion.gait.angle_deg != 0.0:
        return gait_with_start(config, trial, contact)
    start = trial.hand, trial.plan.grasp, trial.surfaces[-1]
    gravity = config.scene.gravity
    return trial, manipulate_object(*start, config.motion, config.clik, contact, gravity=gravity)


def _check(
    config: ManipulationConfig, trial: PlannedTrial, contact: ContactParameters, moved: GaitResult
) -> GaitFigures:
    """Check a gait independently of its planning."""
    found = check_gait(trial.hand, trial.surfaces[-1], moved, contact, gravity=config.scene.gravity)
    figures = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    return GaitFigures(turns=moved.turns, steps=len(moved.steps), verified=not found.violations, **figures)


def _check_sliding(
    config: ManipulationConfig, trial: PlannedTrial, contact: ContactParameters, moved: ManipulationResult
) -> SlidingFigures:
    """Check contacts that slide independently of their planning."""
    found = check_sliding(trial.hand, moved, contact, gravity=config.scene.gravity)
    figures = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    return SlidingFigures(verified=not found.violations, **figures)


def _wrong(gait: GaitFigures | None, sliding: SlidingFigures | None) -> str | None:
    """Return what an independent check found first, one clause; None if nothing."""
    for what, checked in (("gait", gait), ("sliding contacts", sliding)):
        if checked is not None and checked.violations:
            return f"the check of the {what}: {checked.violations[0]}"
    return None


def _write_range(config: ManipulationConfig, trial: PlannedTrial, folder: Path) -> None:
    """Write how far the grasp can move the object along and about each palm axis."""
    contact = config.contact
    held = hold_object(
        trial.hand,
        trial.plan.grasp,
        trial.surfaces[-1],
        contact.kind,
        patch_radius_m=contact.patch_radius_m,
    )
    with (folder / RANGE_FILE).open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(field.name for field in dataclasses.fields(RangeEntry))
        rows.writerows(dataclasses.astuple(entry) for entry in reachable_range(held, config.clik))


def _typed(figures: dict[str, float | int | bool | None]) -> dict[str, Any]:
    return dict(figures)


def _draw(
    config: ManipulationConfig,
    trial: PlannedTrial,
    moved: ManipulationResult,
    played: "InHandResult | None",
    folder: Path,
) -> None:
    from graspbench.report.manipulation_figures import (  # loads Matplotlib
        draw_manipulation,
        write_manipulation,
        write_sliding,
    )

    write_manipulation(moved, folder / "histories.csv")
    if moved.sliding is not None:
        write_sliding(moved, moved.sliding, folder / "sliding.csv")
    if not config.record.pictures:
        return
    posture = trial.executed.grasp.posture
    assert posture is not None, "a plan made with a checker has a posture"
    fingers = {
        trial.hand.finger_names[finger]: trial.hand.finger_joints(finger) for finger in posture.fingers
    }
    title = f"{trial.name}, {trial.hand.name} hand, {config.motion.name}, {config.contact.kind} contacts"
    draw_manipulation(moved, fingers, folder / "manipulation.png", title=title)
    if played is not None and played.times.size:
        from graspbench.report.in_hand_figure import draw_in_hand

        draw_in_hand(played, folder / "in_hand.png", title=f"{title}, played in physics")
