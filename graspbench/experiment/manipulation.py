"""In-hand manipulation, run and stored: a trial up to its grasp, then the motion of the object."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from graspbench.arrays import FloatArray
from graspbench.errors import InputError, TrialError
from graspbench.experiment.clock import StageClock
from graspbench.experiment.config import ManipulationConfig
from graspbench.experiment.planned import PlannedTrial, planned_trial
from graspbench.experiment.provenance import provenance
from graspbench.experiment.results import local_result, object_result
from graspbench.experiment.store import RESULT_FILE, SCHEMA_VERSION, ResultStore, to_json
from graspbench.hand import HandModel
from graspbench.manipulation import ManipulationResult, manipulate_object
from graspbench.planning import fingertip_paths, track
from graspbench.record import TrialLog

if TYPE_CHECKING:
    from graspbench.simulation.in_hand import InHandResult

# What a motion that succeeds keeps to.
POSITION_TOLERANCE_M = 1e-4
ROTATION_TOLERANCE_DEG = 0.1
JOINT_TOLERANCE_DEG = 0.05

_LOG_RATE_HZ = 50.0


def manipulate_and_store(
    config: ManipulationConfig, store: ResultStore, *, on_stage: Callable[[str, float], None] | None = None
) -> dict[str, Any]:
    """Plan a grasp, move the object in the hand, and write the results folder.

    Args:
        config: The trial, the inverse kinematics, the motion and the contacts.
        store: Where the folder goes.
        on_stage: Called with each stage's name and seconds.

    Returns:
        The content of ``result.json``; status "failed" with the reason when there is no grasp, when the
        motion cannot go on, or when the hand does not follow it.

    Raises:
        InputError: What the user gave cannot be used; nothing is written.
    """
    text = yaml.safe_dump(config.as_tree(), sort_keys=False, allow_unicode=True)
    with store.writing(config.trial_id) as folder:
        (folder / "config.yaml").write_text(text, encoding="utf-8")
        try:
            with TrialLog(folder / "manipulation.mcap", config.record) as log:
                log.attach("config.yaml", text)
                outcome = _manipulate(config, log, folder, StageClock(on_stage))
        except InputError:
            raise
        except TrialError as error:
            outcome = {"status": "failed", "reason": str(error), "success": False}
        result = {**_header(config), **outcome, "provenance": provenance()}
        (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def shortcoming(result: ManipulationResult, hand: HandModel) -> str | None:
    """Return in one sentence why a motion is not what was asked for, or None."""
    off = (result.position_error_m > POSITION_TOLERANCE_M) | (
        result.rotation_error_deg > ROTATION_TOLERANCE_DEG
    )
    if off.any():
        since_s = result.history.times[np.argmax(off)]
        far_mm, turned_deg = 1e3 * result.position_error_m.max(), result.rotation_error_deg.max()
        return (
            f"the hand cannot follow the motion, from {since_s:.2f} s on the object is up to {far_mm:.2g} mm "
            f"and {turned_deg:.2g} deg off: ask for a smaller or slower motion, or another contact."
        )
    joints = result.history.joints
    beyond_deg = np.rad2deg(np.maximum(joints - hand.upper, hand.lower - joints)).max(axis=0)
    joint = int(np.argmax(beyond_deg))
    if beyond_deg[joint] > JOINT_TOLERANCE_DEG:
        return (
            f"joint {result.joint_names[joint]} would have to go {beyond_deg[joint]:.2g} deg beyond its "
            "limit: ask for a smaller motion, or use clik=qp."
        )
    return None


def _manipulate(config: ManipulationConfig, log: TrialLog, folder: Path, clock: StageClock) -> dict[str, Any]:
    with planned_trial(config, clock) as trial:
        contact = config.contact
        if contact.mass_kg is None and trial.scene is not None:
            contact = replace(contact, mass_kg=trial.scene.model.mass_kg)
        with clock.stage("manipulation"):
            moved = manipulate_object(
                trial.hand, trial.plan.grasp, trial.surfaces[-1], config.motion, config.clik, contact
            )
        reason = shortcoming(moved, trial.hand)
        played = None if reason else _play(config, trial, moved, clock)
        if played is not None and played.reason:
            reason = f"played in physics: {played.reason}"
        result = {
            "status": "failed" if reason else "done",
            "reason": reason,
            "success": reason is None,
            "object": object_result(trial),
            "local": local_result(trial.plan),
            "manipulation": moved.summary(),
            "in_hand": None if played is None else _in_hand_result(played),
        }
        with clock.stage("record"):
            if played is None:
                _record(log, trial, moved)
            else:
                log.grasp(trial.plan.grasp, "local")
                log.motion(trial.hand.joint_names, played.motion)
            log.scores(_scores(result))
    with clock.stage("pictures"):
        _draw(config, trial, moved, played, folder)
    return {**result, "times_s": dict(clock.seconds)}


def _play(
    config: ManipulationConfig, trial: PlannedTrial, moved: ManipulationResult, clock: StageClock
) -> "InHandResult | None":
    """Play the motion on the simulated object, if that is asked for and there is one."""
    if trial.scene is None or config.execution.until == "off":
        return None
    from graspbench.simulation.in_hand import InHandPath, play_in_hand  # loads PyBullet

    planner, posture = config.planner, trial.plan.grasp.posture
    assert posture is not None, "a plan made with a checker has a posture"
    with clock.stage("paths"):
        paths = fingertip_paths(trial.plan.history, planner.paths, planner.floating_distance_m, trial.hand)
        approach = track(paths, trial.hand, posture, planner.paths)
    path = InHandPath(moved.history.times, moved.history.joints, moved.desired_transforms_object_to_palm)
    with clock.stage("execution"):
        return play_in_hand(trial.scene.world, trial.hand, trial.plan.grasp, approach, path, config.execution)


def _in_hand_result(played: "InHandResult") -> dict[str, Any]:
    """Return what came of the motion in physics; the sampled motion is left to the log."""
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
    histories = ("times", "position_error_m", "rotation_error_deg", "moved_m", "turned_deg")
    return {
        "success": played.success,
        "grip_force_n": played.grip_force_n,
        **errors,
        "phases": {phase.name: asdict(phase) for phase in played.phases},
        "histories": {name: getattr(played, name).tolist() for name in histories},
    }


def _scores(result: dict[str, Any]) -> dict[str, Any]:
    named = {f"manipulation.{key}": value for key, value in result["manipulation"].items()}
    if result["in_hand"] is not None:
        named |= {
            f"in_hand.{key}": value for key, value in result["in_hand"].items() if not isinstance(value, dict)
        }
    return {"success": result["success"], **named}


def _record(log: TrialLog, trial: PlannedTrial, moved: ManipulationResult) -> None:
    log.grasp(trial.plan.grasp, "local")
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
    )

    write_manipulation(moved, folder / "histories.csv")
    if not config.record.pictures:
        return
    posture = trial.plan.grasp.posture
    assert posture is not None, "a plan made with a checker has a posture"
    fingers = {
        trial.hand.finger_names[finger]: trial.hand.finger_joints(finger) for finger in posture.fingers
    }
    title = f"{trial.name}, {trial.hand.name} hand, {config.motion.name}, {config.contact.kind} contacts"
    draw_manipulation(moved, fingers, folder / "manipulation.png", title=title)
    if played is not None and played.times.size:
        from graspbench.report.in_hand_figure import draw_in_hand

        draw_in_hand(played, folder / "in_hand.png", title=f"{title}, played in physics")


def _header(config: ManipulationConfig) -> dict[str, Any]:
    tree = config.as_tree()
    return {
        "schema": SCHEMA_VERSION,
        "kind": "manipulation",
        "trial_id": config.trial_id,
        "seed": config.seed,
        "object": {"name": tree["object"]["name"]},
        "hand": {"name": tree["hand"]["name"], "fingers": tree["hand"]["fingers"]},
        "index": tree["index"],
        "motion": tree["motion"],
        "contact": tree["contact"]["kind"],
        "method": tree["clik"]["method"],
    }
