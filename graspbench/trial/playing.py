"""A planned in-hand motion, played in physics."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from graspbench.config.trial_config import ManipulationConfig
from graspbench.manipulation import GaitResult, ManipulationResult
from graspbench.manipulation.sliding.sliding_history import SlidingHistory
from graspbench.planning import clear_approach
from graspbench.results.physical_results import PlayedResult
from graspbench.simulation.in_hand_path import InHandPath, StepOnPath
from graspbench.trial.clock import StageClock
from graspbench.trial.outcome import phase_results
from graspbench.trial.planned import PlannedTrial

if TYPE_CHECKING:
    from graspbench.simulation.in_hand import InHandResult

_MIN_TURNED_SHARE = 0.9
"""Of the turn that is asked for, so much has to come about in physics."""


def play_motion(
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


def lost_in_physics(config: ManipulationConfig, played: "InHandResult") -> str | None:
    """Return why the motion has failed in physics, one clause; None if it has not."""
    asked, turned = config.motion.gait.angle_deg, played.turned_about_axis_deg
    if played.reason is None and turned is not None and turned / asked < _MIN_TURNED_SHARE:
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


def played_result(played: "InHandResult", slipped_m: float) -> PlayedResult:
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
