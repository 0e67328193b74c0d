"""The eye-in-hand camera follows what the moving table carries, and takes time-stamped images."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.perception.camera import CameraParameters, View
from graspbench.perception.segmentation import SilhouetteParameters
from graspbench.perception.stations import Station, StationParameters
from graspbench.perception.tracking import WIDE_SLANTS_DEG, TrackedViews, track_object
from graspbench.simulation.capture import EyeInHand
from graspbench.simulation.moving_world import MovingWorld


@dataclass(frozen=True)
class MovingCapture:
    """Images of a moving object, and the truth about it, which is for the verdict only.

    Attributes:
        tracked: What the camera saw.
        true_times_s: When images were taken, ascending, shape (n,).
        true_poses: transform_object_to_world then, shape (n, 4, 4).
    """

    tracked: TrackedViews
    true_times_s: FloatArray
    true_poses: FloatArray

    def true_pose(self, time_s: float) -> FloatArray:
        """Return where the object was when an image was taken, shape (4, 4)."""
        pose: FloatArray = self.true_poses[int(np.argmin(np.abs(self.true_times_s - time_s)))]
        return pose


def images_taken(stations: StationParameters) -> int:
    """Return how many images a moving object is looked at with, when none is taken twice."""
    return len(WIDE_SLANTS_DEG) + int(stations.top) + stations.outer.count + stations.inner.count


def capture_moving(
    world: MovingWorld,
    camera_parameters: CameraParameters,
    station_parameters: StationParameters,
    seed: int,
    silhouette_parameters: SilhouetteParameters,
) -> MovingCapture:
    """Follow the object with the camera and take its images, one every ``scene.travel.image_period_s``.

    Raises:
        ImageError: The object, or a single one, is not in view.
        StationError: The stations are degenerate or outside the workspace.
    """
    times: list[float] = []
    poses: list[FloatArray] = []
    with EyeInHand(world, camera_parameters, seed) as camera:

        def take(station: Station) -> View:
            world.advance(world.scene.travel.image_period_s)
            times.append(world.time_s)
            poses.append(world.object_pose())
            return camera.take(station)

        tracked = track_object(
            take, world.entry, station_parameters, camera_parameters.intrinsics, silhouette_parameters
        )
    return MovingCapture(tracked, np.array(times), np.stack(poses))
