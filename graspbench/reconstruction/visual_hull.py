"""The visual hull: all points that project inside every silhouette."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import BoolArray, FloatArray
from graspbench.compiled import compiled
from graspbench.errors import StationError
from graspbench.reconstruction.hull_fields import (
    HullFields,
    build_fields,
    critical_view,
    hull_distance,
    view_gradient,
)

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

SMOOTHING_PX = 0.8
"""Width of the Gaussian that takes the pixels' staircase out of the distance field."""


class VisualHull:
    """Intersection of the silhouettes' cones and, if wanted, of the half-space above the ground.

    Args:
        silhouettes: At least one, with ideal (undistorted) pinhole cameras.
        ground: Whether the hull ends at the plane z = 0.
        smoothing_px: Standard deviation of the Gaussian filter of the distance fields, half as much
            where the silhouette knows the pixels' coverage; 0 for none.

    Raises:
        StationError: There is no silhouette.
        ImageError: A silhouette is empty.
    """

    def __init__(
        self, silhouettes: "Sequence[Silhouette]", ground: bool = True, *, smoothing_px: float = SMOOTHING_PX
    ) -> None:
        if not silhouettes:
            raise StationError("the visual hull has no silhouette", remedy="switch on at least one station")
        self.silhouettes = tuple(silhouettes)
        self.ground = ground
        self.fields = build_fields(self.silhouettes, ground, smoothing_px)

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """Return the signed distance to the hull's border.

        The distance is measured in each image and scaled by depth over focal length; the largest of
        all images counts. Its sign and zero set are the hull's, its size is exact only to first order.

        Args:
            points: World coordinates, shape (n, 3).

        Returns:
            Metres, negative inside, shape (n,).
        """
        points = np.ascontiguousarray(points, dtype=np.float64)
        distances = np.empty(len(points))
        _signed_distances(self.fields, points, distances)
        return distances

    def contains(self, points: FloatArray) -> BoolArray:
        """Return which points lie inside the hull or on its border, shape (n,)."""
        inside: BoolArray = self.signed_distance(points) <= 0.0
        return inside

    def gradient(self, points: FloatArray) -> FloatArray:
        """Return unit vectors along which the signed distance grows fastest, shape (n, 3)."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        directions = np.empty_like(points)
        _gradients(self.fields, points, directions)
        return directions


@compiled
def _gradients(fields: HullFields, points: FloatArray, directions: FloatArray) -> None:
    for a in range(len(points)):
        x, y, z = points[a, 0], points[a, 1], points[a, 2]
        view, _ = critical_view(fields, x, y, z)
        directions[a, 0], directions[a, 1], directions[a, 2] = view_gradient(fields, view, x, y, z)


@compiled
def _signed_distances(fields: HullFields, points: FloatArray, distances: FloatArray) -> None:
    for a in range(len(points)):
        distances[a] = hull_distance(fields, points[a, 0], points[a, 1], points[a, 2])
