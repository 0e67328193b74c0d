"""Silhouettes of a known mesh without any image: what a perfect camera would see.

A pixel belongs to the silhouette when the line of sight through its centre meets a triangle.
"""

from collections.abc import Sequence

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.perception.camera import Camera, Intrinsics
from graspbench.perception.silhouette import Silhouette, silhouette_of_mask


def rasterise(vertices: FloatArray, faces: IntArray, camera: Camera) -> BoolArray:
    """Return the silhouette of a mesh in world coordinates, shape (height, width)."""
    mask = np.zeros((camera.intrinsics.height, camera.intrinsics.width), dtype=np.bool_)
    _fill(camera.project(np.asarray(vertices, dtype=np.float64)), np.asarray(faces, dtype=np.int64), mask)
    return mask


def magnified(camera: Camera, factor: int) -> Camera:
    """Return the same camera with ``factor`` times as many pixels along each side."""
    k = camera.intrinsics
    return Camera(
        Intrinsics(
            k.width * factor, k.height * factor, k.fx * factor, k.fy * factor, k.cx * factor, k.cy * factor
        ),
        camera.transform_camera_to_world,
    )


def exact_silhouettes(
    vertices: FloatArray,
    faces: IntArray,
    cameras: Sequence[Camera],
    names: Sequence[str],
    *,
    magnification: int = 1,
) -> tuple[Silhouette, ...]:
    """Rasterise a mesh from every camera, its resolution magnified."""
    fine = [magnified(camera, magnification) for camera in cameras]
    return tuple(
        silhouette_of_mask(name, rasterise(vertices, faces, camera), camera)
        for name, camera in zip(names, fine, strict=True)
    )


@compiled
def _fill(uv: FloatArray, faces: IntArray, mask: BoolArray) -> None:
    """Set every pixel whose centre lies in a projected triangle."""
    height, width = mask.shape
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, bx, by, cx, cy = uv[i, 0], uv[i, 1], uv[j, 0], uv[j, 1], uv[k, 0], uv[k, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        sign = 1.0 if area > 0 else -1.0
        first_row = max(0, int(np.floor(min(ay, by, cy) - 0.5)))
        last_row = min(height - 1, int(np.ceil(max(ay, by, cy) - 0.5)))
        first_column = max(0, int(np.floor(min(ax, bx, cx) - 0.5)))
        last_column = min(width - 1, int(np.ceil(max(ax, bx, cx) - 0.5)))
        for row in range(first_row, last_row + 1):
            v = row + 0.5
            for column in range(first_column, last_column + 1):
                u = column + 0.5
                if (
                    sign * ((bx - ax) * (v - ay) - (by - ay) * (u - ax)) >= 0
                    and sign * ((cx - bx) * (v - by) - (cy - by) * (u - bx)) >= 0
                    and sign * ((ax - cx) * (v - cy) - (ay - cy) * (u - cx)) >= 0
                ):
                    mask[row, column] = True
