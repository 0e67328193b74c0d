"""Lens distortion after Brown and Conrady, applied and removed exactly."""

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.perception.camera import Camera, Intrinsics, View

_NEWTON_STEPS = 20
_PIXEL_TOLERANCE = 1e-9


def distort(pixels: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """Map ideal pinhole image points to where the lens puts them.

    Args:
        pixels: Ideal image coordinates, shape (n, 2).
        intrinsics: Pinhole parameters with distortion.

    Returns:
        Distorted image coordinates, shape (n, 2).
    """
    k = intrinsics
    x, y = (pixels[:, 0] - k.cx) / k.fx, (pixels[:, 1] - k.cy) / k.fy
    x, y = _distort_normalised(x, y, k.distortion)
    return np.column_stack((k.fx * x + k.cx, k.fy * y + k.cy))


def undistort(pixels: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """Invert `distort` by Newton's method, to 1e-9 of a pixel's angle.

    Args:
        pixels: Distorted image coordinates, shape (n, 2).
        intrinsics: Pinhole parameters with distortion.

    Returns:
        Ideal image coordinates, shape (n, 2).

    Raises:
        ConfigurationError: The distortion folds the image, so no unique ideal point exists.
    """
    k = intrinsics
    xd, yd = (pixels[:, 0] - k.cx) / k.fx, (pixels[:, 1] - k.cy) / k.fy
    x, y = xd.copy(), yd.copy()
    h = 1e-6
    for _ in range(_NEWTON_STEPS):
        fx, fy = _distort_normalised(x, y, k.distortion)
        ex, ey = fx - xd, fy - yd
        if max(np.abs(ex).max(initial=0.0), np.abs(ey).max(initial=0.0)) * k.fx < _PIXEL_TOLERANCE:
            return np.column_stack((k.fx * x + k.cx, k.fy * y + k.cy))
        ax, ay = _distort_normalised(x + h, y, k.distortion)
        bx, by = _distort_normalised(x, y + h, k.distortion)
        a, b, c, d = (ax - fx) / h, (bx - fx) / h, (ay - fy) / h, (by - fy) / h
        determinant = a * d - b * c
        if np.any(determinant < 1e-3):
            break
        x -= (d * ex - b * ey) / determinant
        y -= (a * ey - c * ex) / determinant
    raise ConfigurationError(
        "the lens distortion folds the image onto itself",
        remedy="use smaller coefficients in camera.distortion",
        distortion=k.distortion,
    )


def ideal_view(view: View) -> View:
    """Resample a view as an ideal pinhole of the same size and focal length would have seen it.

    A view without distortion is returned as it is. What the lens did not see repeats the border.
    """
    k = view.camera.intrinsics
    if not any(k.distortion):
        return view
    columns, rows = _distorted_lookup(k)
    image = cv2.remap(view.image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    ideal = replace(k, distortion=(0.0, 0.0, 0.0, 0.0, 0.0))
    mask = view.mask
    if mask is not None:
        share = cv2.remap(
            mask.astype(np.float32), columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        mask = np.asarray(share >= 0.5)
    return View(view.station, image, Camera(ideal, view.camera.transform_camera_to_world), mask)


def pixel_centres(width: int, height: int) -> FloatArray:
    """Return the continuous coordinates of all pixel centres row by row, shape (width * height, 2)."""
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return np.column_stack((u.ravel(), v.ravel()))


@lru_cache(maxsize=4)
def _distorted_lookup(k: Intrinsics) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Return where each ideal pixel's colour lies in the distorted image, as cv2.remap wants it."""
    # cv2 puts pixel centres at whole numbers.
    where = distort(pixel_centres(k.width, k.height), k).reshape(k.height, k.width, 2) - 0.5
    return where[..., 0].astype(np.float32), where[..., 1].astype(np.float32)


def _distort_normalised(
    x: FloatArray, y: FloatArray, distortion: tuple[float, float, float, float, float]
) -> tuple[FloatArray, FloatArray]:
    """Distort points of the plane at unit depth (Brown 1966)."""
    k1, k2, p1, p2, k3 = distortion
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
