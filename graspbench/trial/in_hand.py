"""In-hand manipulation: a trial up to its grasp, then the motion of the object."""

import csv
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspbench.arrays import FloatArray
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
from graspbench.manipulation.sliding.sliding_history import SlidingHistory
from graspbench.planning import clear_approach
from graspbench.record import TrialLog
from graspbench.results.physical_results import GaitFigures, ManipulationSummary, PlayedResult, SlidingFigures
from graspbench.results.plain import as_plain
from graspbench.results.trial_result import TrialResult
from graspbench.simulation.in_hand_path import InHandPath, StepOnPath
from graspbench.trial.clock import StageClock
from graspbench.trial.gait_start import gait_with_start
from graspbench.trial.outcome import (
    local_result,
    object_result,
    phase_results,
    planned_result,
    strengthened_result,
)
from graspbench.trial.planned import PlannedTrial, film, planned_trial

if TYPE_CHECKING:
    from graspbench.simulation.in_hand import InHandResult

RANGE_FILE = "range.csv"

MIN_TURNED_SHARE = 0.9
"""Of the turn that is asked for, so much has to come about in physics."""

_LOG_RATE_HZ = 50.0


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
        played = None if reason else _play(config, trial, moved, clock)
        lost = None if played is None else _lost(config, played)
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
            in_hand=None if played is None else _played_result(played, config.execution.push_slip_m),
        )
        with clock.stage("record"):
            if played is None:
                _record(log, trial, moved)
            else:
                _record_grasps(log, trial)
                log.motion(trial.hand.joint_names, played.motion)
            log.scores(_scores(result))
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


def _play(
    config: ManipulationConfig, trial: PlannedTrial, moved: ManipulationResult, clock: StageClock
) -> "InHandResult | None":
    """Play the motion on the simulated object, if that is asked for and there is one."""
    if trial.scene is None or config.execution.until == "off":
        return None
    from graspbench.simulation.in_hand import play_in_hand  # loads PyBullet
    from graspbench.simulation.tip_friction import tip_friction

    with clock.stage("paths"):
        _, approach = clear_approach(
            trial.executed.history,
            trial.surfaces[-1],
            trial.hand,
            config.planner,
            trial.checker.ground_height_m,
        )
    path = _path(moved)
    soft_torsion_m = config.contact.forces.torsion_m if config.contact.kind == "soft" else None
    pad = config.contact.forces.pad if config.contact.kind == "soft_pad" else None
    friction = tip_friction(config.execution, config.quality, trial.surfaces[-1], soft_torsion_m, pad)
    with clock.stage("execution"):
        return play_in_hand(
            trial.scene.world,
            trial.hand,
            trial.executed.grasp,
            approach,
            path,
            config.execution,
            friction,
            config.arm,
        )


def _lost(config: ManipulationConfig, played: "InHandResult") -> str | None:
    """Return why the motion has failed in physics, one clause; None if it has not."""
    asked, turned = config.motion.gait.angle_deg, played.turned_about_axis_deg
    if played.reason is None and turned is not None and turned / asked < MIN_TURNED_SHARE:
        return f"the object was held, but turned only {turned:.0f} of {asked:g} deg"
    return played.reason


def _path(moved: ManipulationResult) -> InHandPath:
    """Return a motion as physics plays it, with the steps of a gait."""
    times, poses = moved.history.times, moved.desired_transforms_object_to_palm
    if not isinstance(moved, GaitResult):
        path = InHandPath(times, moved.history.joints, poses)
        return path if moved.sliding is None else _with_sliding(path, moved, moved.sliding)
    steps = []
    for step in moved.steps:
        at = int(np.argmin(np.abs(times - step.to_s)))
        inward = -poses[at, :3, :3] @ moved.contact_normals[at, step.contact]
        steps.append(StepOnPath(step.contact, step.from_s, step.to_s, inward))
    return InHandPath(times, moved.history.joints, poses, moved.axis, tuple(steps))


def _with_sliding(path: InHandPath, moved: ManipulationResult, sliding: SlidingHistory) -> InHandPath:
    """Return a path with its contacts that slide and the normal force that they have on the mean."""
    at = np.searchsorted(path.times, moved.force_times - 1e-9)
    rotations = path.transforms_object_to_palm[at, :3, :3]
    normals = np.einsum("tij,tnj->tni", rotations, moved.contact_normals[at])
    pressing = -np.einsum("tni,tni->tn", moved.forces, normals)[:, list(sliding.contacts)]
    return dataclasses.replace(path, sliding=sliding.contacts, sliding_n=float(pressing.mean()))


def _typed(figures: dict[str, float | int | bool | None]) -> dict[str, Any]:
    return dict(figures)


def _played_result(played: "InHandResult", slipped_m: float) -> PlayedResult:
    """Return what came of the motion in physics; the sampled motion is left to the log.

    Args:
        played: What came of it.
        slipped_m: A finger that slid farther on one contact counts as slipped.
    """
    errors = (
        {}
        if not played.times.size
        else {
            "position_error_max_m": float(played.position_error_m.max()),
            "position_error_end_m": float(played.position_error_m[-1]),
            "rotation_error_max_deg": float(played.rotation_error_deg.max()),
            "rotation_error_end_deg": float(played.rotation_error_deg[-1]),
            "moved_max_m": float(played.moved_m.max()),
            "turned_max_deg": float(played.turned_deg.max()),
        }
    )
    slid = None if played.slips_m.size == 0 else float(played.slips_m.max())
    histories = ("times", "position_error_m", "rotation_error_deg", "moved_m", "turned_deg")
    return PlayedResult(
        success=played.success,
        friction=played.friction,
        torsional_friction_m=played.torsional_friction_m,
        planned_friction=played.planned_friction,
        grip_force_n=played.grip_force_n,
        phases=phase_results(played.phases),
        turned_about_axis_deg=played.turned_about_axis_deg,
        slip_max_m=slid,
        fingers_slipped=int(np.sum(played.slips_m > slipped_m)),
        steps=played.steps,
        steps_missed=played.steps_missed,
        histories={name: tuple(getattr(played, name).tolist()) for name in histories},
        **errors,
    )


def _scores(result: TrialResult) -> dict[str, Any]:
    scores: dict[str, Any] = {"success": result.success}
    for part in ("manipulation", "in_hand"):
        for key, value in (as_plain(getattr(result, part)) or {}).items():
            if not isinstance(value, dict):
                scores[f"{part}.{key}"] = value
    return scores


def _record_grasps(log: TrialLog, trial: PlannedTrial) -> None:
    log.grasp(trial.plan.grasp, "local")
    if trial.strengthened is not None:
        log.grasp(trial.strengthened.grasp, "strengthened")


def _record(log: TrialLog, trial: PlannedTrial, moved: ManipulationResult) -> None:
    _record_grasps(log, trial)
    period = moved.history.times[1] - moved.history.times[0]
    shown = slice(None, None, max(round(1.0 / (_LOG_RATE_HZ * period)), 1))
    log.joints(
        moved.joint_names,
        moved.history.times[shown],
        moved.history.joints[shown],
        np.broadcast_to(moved.transform_palm_to_world, (len(moved.history.times[shown]), 4, 4)),
        transform_object_to_world=_object_poses(trial, moved)[shown],
    )


def _object_poses(trial: PlannedTrial, moved: ManipulationResult) -> FloatArray:
    """Return the object's pose in the world by time, shape (t, 4, 4).

    The object's own frame where it was simulated, else the one at the grasp's centroid.
    """
    poses = moved.transform_palm_to_world @ moved.transforms_object_to_palm
    if trial.scene is None:
        return np.asarray(poses)
    return np.asarray(poses @ np.linalg.inv(poses[0]) @ trial.scene.transform_object_to_world)


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
