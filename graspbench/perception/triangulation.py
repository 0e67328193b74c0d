"""Where the viewing rays of several silhouettes meet."""

from collections.abc import Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import StationError
from graspbench.perception.silhouette import Silhouette

_SMALLEST_EIGENVALUE = 1e-6


def triangulate_centre(silhouettes: Sequence[Silhouette]) -> FloatArray:
    """Guess the object's centre of mass: the point nearest to all centroids' viewing rays.

    Minimises the sum over views of |(I - d d^T)(x - o)|^2, o the optical centre and d the viewing
    direction of the silhouette's centroid (thesis 3.2.3).

    Args:
        silhouettes: At least two, seen from different directions.

    Returns:
        The point in the world, shape (3,).

    Raises:
        StationError: All rays are parallel (or there is only one), so no point is singled out.
    """
    origins = np.array([s.camera.position for s in silhouettes])
    directions = np.array([s.camera.rays(s.centroid[None])[0] for s in silhouettes])
    return meet_rays(origins, directions)


def meet_rays(origins: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the point with the least sum of squared distances to lines.

    Args:
        origins: A point on each line, shape (n, 3).
        directions: Unit direction of each line, shape (n, 3).

    Raises:
        StationError: The lines are parallel.
    """
    projectors = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    total = projectors.sum(axis=0)
    if len(origins) < 2 or np.linalg.eigvalsh(total)[0] < _SMALLEST_EIGENVALUE * len(origins):
        raise StationError(
            "all views look along one direction, so the object's distance stays unknown",
            remedy="add stations from other directions",
            views=len(origins),
        )
    point: FloatArray = np.linalg.solve(total, np.einsum("nij,nj->i", projectors, origins))
    return point
