"""What goes into a trial's log, and when."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.planning import FingertipPath, GlobalResult, JointPath
from graspbench.record import TrialLog
from graspbench.results.plain import as_plain
from graspbench.results.trial_result import TrialResult
from graspbench.trial.planned import PlannedTrial

if TYPE_CHECKING:
    from graspbench.manipulation import ManipulationResult

_LOG_RATE_HZ = 50.0


def record_plan(log: TrialLog, trial: PlannedTrial) -> None:
    """Record what a grasp was planned on, and the grasp."""
    if trial.followed is not None:
        followed = trial.followed
        log.followed_views(
            followed.capture.tracked.views,
            trial.silhouettes,
            [followed.capture.true_pose(view.time_s or 0.0) for view in trial.views],
            [followed.estimated_pose(view.time_s or 0.0) for view in trial.views],
        )
    else:
        log.views(trial.views, trial.silhouettes)
    if trial.scene is not None:
        log.object_pose(trial.scene.transform_object_to_world)
    for surface in trial.surfaces:
        log.surface(surface)
    record_grasps(log, trial)


def record_grasps(log: TrialLog, trial: PlannedTrial) -> None:
    """Record the planned grasp, and the one that is executed in its place."""
    log.grasp(trial.plan.grasp, "local")
    if trial.strengthened is not None:
        log.grasp(trial.strengthened.grasp, "strengthened")


def record_paths(
    log: TrialLog,
    trial: PlannedTrial,
    best: Mapping[str, GlobalResult],
    paths: tuple[FingertipPath, ...],
    motion: JointPath,
) -> None:
    """Record the way to the grasp that is executed, and the grasps that it is compared with."""
    if trial.explored is not None:
        log.grasp(trial.explored.grasp, "explored")
    for measure, found in best.items():
        if found.grasp is not None:
            log.grasp(found.grasp, f"global-{measure}")
    log.paths(paths)
    log.joints(trial.hand.joint_names, motion.times, motion.joints, motion.transform_palm_to_world)


def grasp_scores(result: TrialResult) -> dict[str, object]:
    """Return the figures of a grasp that a log ends with."""
    scores: dict[str, object] = {"success": result.success}
    for measure in ("q1", "q2", "q3"):
        scores[f"local.{measure}"] = getattr(result.local, measure)
    for measure, found in result.global_.items():
        scores[f"global.{measure}"] = found.value
        scores[f"ratio.{measure}"] = result.ratio.get(measure)
    return scores


def record_in_hand(log: TrialLog, trial: PlannedTrial, moved: "ManipulationResult") -> None:
    """Record a planned in-hand motion with the grasp that it starts from."""
    record_grasps(log, trial)
    period = moved.history.times[1] - moved.history.times[0]
    shown = slice(None, None, max(round(1.0 / (_LOG_RATE_HZ * period)), 1))
    log.joints(
        moved.joint_names,
        moved.history.times[shown],
        moved.history.joints[shown],
        np.broadcast_to(moved.transform_palm_to_world, (len(moved.history.times[shown]), 4, 4)),
        transform_object_to_world=_object_poses(trial, moved)[shown],
    )


def _object_poses(trial: PlannedTrial, moved: "ManipulationResult") -> FloatArray:
    """Return the object's pose in the world by time, shape (t, 4, 4).

    The object's own frame where it was simulated, else the one at the grasp's centroid.
    """
    poses = moved.transform_palm_to_world @ moved.transforms_object_to_palm
    if trial.scene is None:
        return np.asarray(poses)
    return np.asarray(poses @ np.linalg.inv(poses[0]) @ trial.scene.transform_object_to_world)


def in_hand_scores(result: TrialResult) -> dict[str, Any]:
    """Return the figures of an in-hand motion that a log ends with."""
    scores: dict[str, Any] = {"success": result.success}
    for part in ("manipulation", "in_hand"):
        for key, value in (as_plain(getattr(result, part)) or {}).items():
            if not isinstance(value, dict):
                scores[f"{part}.{key}"] = value
    return scores
