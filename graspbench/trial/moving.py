"""The front of a trial whose object moves: timed images, its motion from them, cameras carried along."""

from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.config.trial_config import TrialConfig
from graspbench.geometry import ObjectModel
from graspbench.perception import Silhouette, View
from graspbench.perception import silhouettes as find_silhouettes
from graspbench.reconstruction.motion_estimate import (
    MotionEstimate,
    camera_in_object_frame,
    estimate_motion,
)
from graspbench.results.physical_results import MovingResult
from graspbench.trial.clock import StageClock

if TYPE_CHECKING:
    from graspbench.simulation.capture_moving import MovingCapture
    from graspbench.simulation.moving_world import MovingWorld
    from graspbench.simulation.ride import Ride


@dataclass
class FollowedObject:
    """A moving object, followed by the camera and then by the hand.

    Attributes:
        world: The simulated world, in which time goes by.
        capture: What the camera saw, and the truth for the verdict.
        estimate: The motion, from the images alone; all is planned where the object is at its reference time.
        start_error_m: How far the pivot is from where the estimate says, when the hand begins to move.
        start_error_deg: By how much the object is turned from that.
    """

    world: "MovingWorld"
    capture: "MovingCapture"
    estimate: MotionEstimate
    start_error_m: float | None = None
    start_error_deg: float | None = None

    @property
    def reference_pose(self) -> FloatArray:
        """Where the object truly was at the reference time, shape (4, 4)."""
        return self.capture.true_pose(self.estimate.motion.reference_time_s)

    def estimated_pose(self, time_s: float) -> FloatArray:
        """Return the pose of a frame, at the pivot at the reference time, that moves as estimated, (4, 4)."""
        there = np.eye(4)
        there[:3, 3] = self.estimate.motion.pivot
        pose: FloatArray = self.estimate.motion.displacement(time_s) @ there
        return pose

    def begin(self) -> "Ride":
        """Let the planning's time go by; return the motion that the hand is to follow from now on."""
        from graspbench.simulation.ride import Ride

        self.world.advance(self.world.scene.travel.planning_time_s)
        error = self.errors(np.array([self.world.time_s]), self.world.object_pose()[None])
        self.start_error_m, self.start_error_deg = float(error[0][0]), float(error[1][0])
        return Ride(self.estimate.motion, self.world.time_s)

    def errors(self, times_s: FloatArray, true_poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far the estimate is from the truth: m and deg, shape (n,) each."""
        motion = self.estimate.motion
        really = true_poses @ np.linalg.inv(self.reference_pose)
        off = np.linalg.inv(motion.displacements(times_s)) @ really
        places = off[:, :3, :3] @ motion.pivot + off[:, :3, 3] - motion.pivot
        turns = np.degrees(Rotation.from_matrix(off[:, :3, :3]).magnitude())
        return np.linalg.norm(places, axis=1), turns

    def result(self, kind: str) -> MovingResult:
        """Return how the object moved and how well that was known."""
        motion, capture = self.estimate.motion, self.capture
        velocity, yaw_rate = self._true_twist()
        path_m, path_deg = self.errors(capture.true_times_s, capture.true_poses)
        return MovingResult(
            motion=kind,
            images=len(capture.true_times_s),
            duration_s=float(np.ptp(capture.true_times_s)),
            varies=motion.varies,
            speed_m_s=motion.speed_m_s,
            true_speed_m_s=float(np.linalg.norm(velocity)),
            velocity_error_m_s=float(np.linalg.norm(velocity - motion.velocity_m_s)),
            yaw_rate_deg_s=float(np.degrees(motion.yaw_rate_rad_s)),
            true_yaw_rate_deg_s=float(np.degrees(yaw_rate)),
            yaw_rate_error_deg_s=float(np.degrees(abs(yaw_rate - motion.yaw_rate_rad_s))),
            coherence_rms_mm=1e3 * self.estimate.coherence_rms_m,
            path_error_max_mm=1e3 * float(path_m.max()),
            path_error_max_deg=float(path_deg.max()),
            start_error_mm=None if self.start_error_m is None else 1e3 * self.start_error_m,
            start_error_deg=self.start_error_deg,
            transform_object_to_world=tuple(tuple(row) for row in self.reference_pose.tolist()),
        )

    def _true_twist(self) -> tuple[FloatArray, float]:
        """Return the pivot's true velocity along x and y and the yaw rate, about the reference time."""
        capture, motion = self.capture, self.estimate.motion
        middle = int(np.argmin(np.abs(capture.true_times_s - motion.reference_time_s)))
        first, last = max(middle - 1, 0), min(middle + 1, len(capture.true_times_s) - 1)
        local = np.linalg.inv(self.reference_pose) @ np.append(motion.pivot, 1.0)
        moved = (capture.true_poses[last] - capture.true_poses[first]) @ local
        turn = capture.true_poses[last][:3, :3] @ capture.true_poses[first][:3, :3].T
        span = float(capture.true_times_s[last] - capture.true_times_s[first])
        return moved[:2] / span, float(Rotation.from_matrix(turn).as_rotvec()[2]) / span


def follow_object(
    config: TrialConfig, model: ObjectModel, clock: StageClock, stack: ExitStack
) -> tuple[FollowedObject, tuple[View, ...], tuple[Silhouette, ...]]:
    """Let the object move, follow it with the camera, and find its motion from the images.

    Args:
        config: What to run.
        model: The object.
        clock: Times the stages.
        stack: Closes the world.

    Returns:
        The object; the stations' views and their silhouettes, with the cameras where the object at the
        reference time would have been seen from.
    """
    from graspbench.simulation.capture_moving import capture_moving, images_taken
    from graspbench.simulation.moving_world import MovingWorld

    travel = config.scene.travel
    lead_s = 0.5 * images_taken(config.stations) * travel.image_period_s
    with clock.stage("scene"):
        world = stack.enter_context(MovingWorld(model, config.scene, config.seed, lead_s))
    with clock.stage("images"):
        capture = capture_moving(world, config.camera, config.stations, config.seed, config.silhouette)
    views = capture.tracked.views
    found = clock.run("silhouettes", partial(find_silhouettes, views, config.silhouette))
    view_times_s = np.array([view.time_s for view in views], dtype=np.float64)
    estimate = clock.run(
        "motion",
        lambda: estimate_motion(
            (*capture.tracked.wide, *found),
            np.concatenate((capture.tracked.wide_times_s, view_times_s)),
            float(view_times_s[len(views) // 2]),
            ground=config.surface.ground,
        ),
    )
    still, outlines = [], []
    for view, silhouette, time_s in zip(views, found, view_times_s.tolist(), strict=True):
        still.append(replace(view, camera=camera_in_object_frame(view.camera, estimate.motion, time_s)))
        camera = camera_in_object_frame(silhouette.camera, estimate.motion, time_s)
        outlines.append(replace(silhouette, camera=camera))
    return FollowedObject(world, capture, estimate), tuple(still), tuple(outlines)
