"""An object's motion from the centroids of its silhouettes alone, each with its time."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import StationError
from graspbench.geometry.planar_motion import PlanarMotion
from graspbench.perception.silhouette import Silhouette

MIN_TIMED_VIEWS = 4


class CentroidFit(NamedTuple):
    """The motion that passes nearest to the centroids' viewing rays.

    Attributes:
        motion: Its pivot is the centre at the reference time.
        rms_m: Root mean square distance of the moving centre to the rays.
    """

    motion: PlanarMotion
    rms_m: float


def fit_centroids(
    silhouettes: Sequence[Silhouette], times_s: FloatArray, reference_time_s: float, yaw_rate_rad_s: float
) -> CentroidFit:
    """Fit a constant twist with a given yaw rate to the centroids: one linear least squares problem.

    With the yaw rate known, the centre's path is linear in its first place and in its velocity in the turning
    frame:
    c(t) = c_0 + (integral of R_z(yaw) dt) u. Minimised is the sum of |(I - d d^T)(c(t_i) - o_i)|^2 over
    the images, the triangulation of the thesis (3.2.3) with time in it.

    Args:
        silhouettes: At least four, seen from different directions at different times.
        times_s: When, shape (n,).
        reference_time_s: The motion's reference time.
        yaw_rate_rad_s: The yaw rate taken for granted.

    Raises:
        StationError: The images are too few, at one time or from one direction.
    """
    if len(silhouettes) < MIN_TIMED_VIEWS or np.ptp(times_s) <= 0.0:
        raise StationError(
            f"{len(silhouettes)} time-stamped views do not tell how the object moves",
            remedy=f"take at least {MIN_TIMED_VIEWS}, at different times",
            views=len(silhouettes),
        )
    origins = np.array([s.camera.position for s in silhouettes])
    rays = np.array([s.camera.rays(s.centroid[None])[0] for s in silhouettes])
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    # Columns: the path of a pivot at the origin for a unit velocity along x, and along y.
    unit = PlanarMotion(np.zeros(3), reference_time_s, (1.0, 0.0), yaw_rate_rad_s).displacements(times_s)
    x, y = unit[:, 0, 3], unit[:, 1, 3]
    design = np.zeros((len(silhouettes), 3, 5))
    design[:, :, :3] = np.eye(3)
    design[:, 0, 3], design[:, 1, 3] = x, y
    design[:, 0, 4], design[:, 1, 4] = -y, x
    matrix = (across @ design).reshape(-1, 5)
    right = np.einsum("nij,nj->ni", across, origins).ravel()
    solution, _, rank, _ = np.linalg.lstsq(matrix, right, rcond=1e-9)
    if rank < 5:
        raise StationError(
            "the time-stamped views look along one direction, so the object's motion stays unknown",
            remedy="add stations from other directions",
            views=len(silhouettes),
        )
    rms = float(np.sqrt(np.mean(np.sum((matrix @ solution - right).reshape(-1, 3) ** 2, axis=1))))
    velocity = (float(solution[3]), float(solution[4]))
    return CentroidFit(PlanarMotion(solution[:3], reference_time_s, velocity, yaw_rate_rad_s), rms)
