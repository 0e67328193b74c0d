"""A coarse look at the visual hull inside an ellipsoid's box."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError
from graspbench.reconstruction.ellipsoid import Ellipsoid
from graspbench.reconstruction.visual_hull import VisualHull

RESOLUTIONS = (20, 40, 80)
"""Cells along each axis, tried in turn until enough of them lie in the hull."""

ENOUGH_CELLS = 30

SHALLOW_SHARE = 0.1


def coarse_border(hull: VisualHull, box: Ellipsoid) -> FloatArray:
    """Return points of the hull's border, spread evenly, shape (n, 3).

    Args:
        hull: The visual hull.
        box: An ellipsoid that holds it.

    Raises:
        ReconstructionError: The silhouettes have no point in common.
    """
    cells, distances, diagonal = _carve(hull, box)
    points = cells[np.abs(distances) < 0.75 * diagonal]
    for _ in range(2):
        points = points - hull.signed_distance(points)[:, None] * hull.gradient(points)
    return points[np.abs(hull.signed_distance(points)) < 0.05 * diagonal]


def interior_point(hull: VisualHull, box: Ellipsoid, wanted: FloatArray) -> FloatArray:
    """Return a point well inside the hull: the wanted one if it is, else the deepest found.

    The centre of mass of a bent or hollow object need not lie in it.

    Args:
        hull: The visual hull.
        box: An ellipsoid that holds it.
        wanted: Shape (3,).

    Raises:
        ReconstructionError: The silhouettes have no point in common.
    """
    depth = -float(hull.signed_distance(wanted[None])[0])
    if depth > SHALLOW_SHARE * float(box.semi_axes[2]):
        return wanted
    cells, distances, _ = _carve(hull, box)
    deepest = int(np.argmin(distances))
    return wanted if depth > -float(distances[deepest]) else cells[deepest]


def _carve(hull: VisualHull, box: Ellipsoid) -> tuple[FloatArray, FloatArray, float]:
    """Return the centres of a grid's cells, their distances to the hull and a cell's diagonal."""
    for count in RESOLUTIONS:
        side = (np.arange(count) + 0.5) * (2.0 / count) - 1.0
        unit = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
        cells = box.centre + (unit * box.semi_axes) @ box.axes.T
        distances = hull.signed_distance(cells)
        if np.count_nonzero(distances <= 0.0) >= ENOUGH_CELLS:
            return cells, distances, float(np.linalg.norm(2.0 * box.semi_axes / count))
    raise ReconstructionError(
        "the silhouettes have no point in common",
        remedy="check the camera calibration and that the object did not move",
        stations=[silhouette.station for silhouette in hull.silhouettes],
    )
