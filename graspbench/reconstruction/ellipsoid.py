"""Ellipsoids: the first shape of the reconstruction surface."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid in the world.

    Attributes:
        centre: Shape (3,).
        axes: Unit axes as columns, right-handed, shape (3, 3).
        semi_axes: Lengths of the semi-axes, descending, shape (3,).
    """

    centre: FloatArray
    axes: FloatArray
    semi_axes: FloatArray

    def level(self, points: FloatArray) -> FloatArray:
        """Return the factor by which the ellipsoid must grow to reach each point, shape (n,)."""
        levels: FloatArray = np.linalg.norm((points - self.centre) @ self.axes / self.semi_axes, axis=1)
        return levels

    @property
    def volume_m3(self) -> float:
        """Enclosed volume."""
        return float(4.0 / 3.0 * np.pi * np.prod(self.semi_axes))


def moment_ellipsoid(points: FloatArray) -> Ellipsoid:
    """Return the ellipsoid of the points' pseudo-inertia tensor (thesis 3.2.3), one standard deviation.

    The first two axes point to where the points' third moment along them is positive, so that the
    frame turns with the points; the third makes it right-handed.

    Args:
        points: Not all in one plane, shape (n, 3).

    Raises:
        ReconstructionError: The points lie in a plane.
    """
    mean = points.mean(axis=0)
    about = points - mean
    values, vectors = np.linalg.eigh(about.T @ about / len(points))
    if values[0] <= 1e-10 * values[2]:
        raise ReconstructionError(
            "the space that the silhouettes leave has no volume",
            remedy="check the camera calibration and the silhouettes",
        )
    axes = vectors[:, ::-1].copy()
    for k in range(2):
        skewness = np.mean((about @ axes[:, k]) ** 3) / values[2 - k] ** 1.5
        lead = axes[np.abs(axes[:, k]).argmax(), k]
        if (skewness if abs(skewness) > 1e-6 else lead) < 0:
            axes[:, k] *= -1.0
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return Ellipsoid(mean, axes, np.sqrt(values[::-1]))


def wrap(ellipsoid: Ellipsoid, points: FloatArray, margin: float) -> Ellipsoid:
    """Scale an ellipsoid so that it just wraps the points, times a margin."""
    return scaled(ellipsoid, float(ellipsoid.level(points).max()) * margin)


def scaled(ellipsoid: Ellipsoid, factor: float) -> Ellipsoid:
    """Return the ellipsoid with its semi-axes multiplied by ``factor``."""
    return Ellipsoid(ellipsoid.centre, ellipsoid.axes, ellipsoid.semi_axes * factor)
