"""Points that cover the border of a visual hull."""

import numpy as np
from scipy import ndimage

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError
from graspbench.reconstruction.visual_hull import VisualHull

NEWTON_STEPS = 3


def sample_border(hull: VisualHull, low: FloatArray, high: FloatArray, spacing_m: float) -> FloatArray:
    """Cover the border of a visual hull: grid points near it, moved onto the zero of its distance.

    Only the largest connected part counts: silhouettes that cross at random leave islands beside
    the object that no surface around it should follow.

    Args:
        hull: The visual hull.
        low: Lower corner of a box that holds it, shape (3,).
        high: Upper corner, shape (3,).
        spacing_m: Of the grid.

    Returns:
        Border points, neighbours less than 1.5 spacings apart, shape (n, 3).

    Raises:
        ReconstructionError: No grid point lies in the hull.
    """
    axes = [
        np.arange(a - 2 * spacing_m, b + 3 * spacing_m, spacing_m) for a, b in zip(low, high, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distances = hull.signed_distance(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    labels, count = ndimage.label(distances <= 0.0)
    if count == 0:
        raise ReconstructionError(
            "the silhouettes have no point in common",
            remedy="check the camera calibration and that the object did not move",
        )
    largest = labels == 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
    near = ndimage.binary_dilation(largest) & (np.abs(distances) < 1.5 * spacing_m)
    points: FloatArray = grid[near]
    for _ in range(NEWTON_STEPS):
        points = points - hull.signed_distance(points)[:, None] * hull.gradient(points)
    return points[np.abs(hull.signed_distance(points)) < 0.05 * spacing_m]
