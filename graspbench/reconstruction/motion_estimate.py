"""The motion of an object from its time-stamped silhouettes, and the cameras as the object sees them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.geometry.planar_motion import PlanarMotion
from graspbench.perception.camera import Camera
from graspbench.perception.centroid_motion import fit_centroids
from graspbench.perception.triangulation import triangulate_centre
from graspbench.reconstruction.silhouette_coherence import SilhouetteCoherence, best_twist

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

MAX_YAW_RATE_RAD_S = 1.3
_YAW_RATES = np.linspace(-MAX_YAW_RATE_RAD_S, MAX_YAW_RATE_RAD_S, 27)


@dataclass(frozen=True)
class MotionEstimate:
    """How an object moved while images were taken of it, from the images alone.

    Attributes:
        motion: Its pivot is the triangulated centre at the reference time.
        coherence_rms_m: By how far outline rays miss the hull of the other silhouettes, root mean square.
        centroid_rms_m: How far the moving centre passes the centroids' rays, root mean square.
    """

    motion: PlanarMotion
    coherence_rms_m: float
    centroid_rms_m: float


def estimate_motion(
    silhouettes: "Sequence[Silhouette]",
    times_s: FloatArray,
    reference_time_s: float,
    *,
    ground: bool = True,
) -> MotionEstimate:
    """Estimate an object's motion on a level table from time-stamped silhouettes.

    For each of a range of yaw rates the centroids give the velocity (`fit_centroids`); those motions are the
    first guesses, of which the silhouettes' coherence chooses and which it refines (`best_twist`).

    Args:
        silhouettes: With ideal pinhole cameras, world frame; at least four.
        times_s: When each was taken, shape (n,).
        reference_time_s: When the object is where the estimate's pivot is.
        ground: Whether the object stands on the plane z = 0.

    Raises:
        StationError: The images are too few, at one time or from one direction.
    """
    times_s = np.asarray(times_s, dtype=np.float64)
    fits = [fit_centroids(silhouettes, times_s, reference_time_s, float(rate)) for rate in _YAW_RATES]
    middle = min(fits, key=lambda fit: fit.rms_m)
    radius_m = max(
        _radius(s, place) for s, place in zip(silhouettes, middle.motion.places(times_s), strict=True)
    )
    coherence = SilhouetteCoherence(silhouettes, times_s, radius_m, ground=ground)
    motion, rms = best_twist(coherence, [fit.motion for fit in fits], reference_time_s)
    seen = [
        replace(s, camera=camera_in_object_frame(s.camera, motion, float(time)))
        for s, time in zip(silhouettes, times_s, strict=True)
    ]
    return MotionEstimate(motion.about(triangulate_centre(seen)), rms, middle.rms_m)


def camera_in_object_frame(camera: Camera, motion: PlanarMotion, time_s: float) -> Camera:
    """Return a camera as if it had looked at the object where it is at the motion's reference time."""
    pose = np.linalg.inv(motion.displacement(time_s)) @ camera.transform_camera_to_world
    return replace(camera, transform_camera_to_world=pose)


def _radius(silhouette: "Silhouette", centre: FloatArray) -> float:
    """Return the radius of a ball about a centre that holds what a silhouette's box shows."""
    u_min, v_min, u_max, v_max = silhouette.box
    corners = np.array([[u_min, v_min], [u_max, v_min], [u_max, v_max], [u_min, v_max]])
    towards = centre - silhouette.camera.position
    distance = float(np.linalg.norm(towards))
    cosine = float((silhouette.camera.rays(corners) @ (towards / distance)).min())
    return distance * float(np.sqrt(1.0 - cosine**2))
