"""Exact silhouettes of triangle meshes: an oracle that shares no code with the renderers.

A pixel belongs to the silhouette when the line of sight through its centre meets a triangle.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.perception.camera import Camera, Intrinsics


@dataclass(frozen=True, eq=False)
class ExactSilhouette:
    """The fields of `graspbench.perception.silhouette.Silhouette`, filled without any image."""

    station: str
    mask: BoolArray
    box: tuple[float, float, float, float]
    centroid: FloatArray
    camera: Camera


def look_at(position: FloatArray, target: FloatArray, intrinsics: Intrinsics) -> Camera:
    """Return the camera at ``position`` whose optical axis meets ``target``, image up towards +z."""
    forward = (target - position) / np.linalg.norm(target - position)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    transform = np.eye(4)
    transform[:3, :3] = np.column_stack((right, np.cross(forward, right), forward))
    transform[:3, 3] = position
    return Camera(intrinsics, transform)


def ring_of_cameras(
    target: FloatArray,
    *,
    outer: int = 8,
    outer_angle_deg: float = 65.0,
    inner: int = 4,
    inner_angle_deg: float = 35.0,
    top: bool = True,
    radius_m: float = 0.45,
    intrinsics: Intrinsics | None = None,
) -> dict[str, Camera]:
    """Return the thesis' stations around ``target``, by name."""
    if intrinsics is None:
        intrinsics = Intrinsics(640, 480, 580.0, 580.0, 320.0, 240.0)
    places = {"top": (0.0, 0.0)} if top else {}
    for name, count, angle_deg in (("outer", outer, outer_angle_deg), ("inner", inner, inner_angle_deg)):
        for k in range(count):
            places[f"{name}-{k}"] = (np.radians(angle_deg), 2 * np.pi * k / count)
    return {
        name: look_at(
            target + radius_m * np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)]),
            target,
            intrinsics,
        )
        for name, (a, b) in places.items()
    }


def rasterise(vertices: FloatArray, faces: IntArray, camera: Camera) -> BoolArray:
    """Return the silhouette of a mesh, shape (height, width)."""
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


def silhouette_of_mask(station: str, mask: BoolArray, camera: Camera) -> ExactSilhouette:
    """Wrap a mask with its bounding box and centroid."""
    rows, columns = np.nonzero(mask)
    box = (float(columns.min()), float(rows.min()), float(columns.max() + 1), float(rows.max() + 1))
    return ExactSilhouette(station, mask, box, np.array([columns.mean() + 0.5, rows.mean() + 0.5]), camera)


def exact_silhouettes(
    vertices: FloatArray, faces: IntArray, cameras: dict[str, Camera], *, magnification: int = 1
) -> tuple[ExactSilhouette, ...]:
    """Rasterise a mesh, in world coordinates, from every camera."""
    return tuple(
        silhouette_of_mask(name, rasterise(vertices, faces, camera), camera)
        for name, camera in ((n, magnified(c, magnification)) for n, c in cameras.items())
    )


@njit(cache=True)  # type: ignore[misc]
def _fill(uv: FloatArray, faces: IntArray, mask: BoolArray) -> None:
    height, width = mask.shape
    for f in range(len(faces)):
        a, b, c = uv[faces[f, 0]], uv[faces[f, 1]], uv[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        sign = 1.0 if area > 0 else -1.0
        r0 = max(0, int(np.floor(min(a[1], b[1], c[1]) - 0.5)))
        r1 = min(height - 1, int(np.ceil(max(a[1], b[1], c[1]) - 0.5)))
        c0 = max(0, int(np.floor(min(a[0], b[0], c[0]) - 0.5)))
        c1 = min(width - 1, int(np.ceil(max(a[0], b[0], c[0]) - 0.5)))
        for r in range(r0, r1 + 1):
            v = r + 0.5
            for col in range(c0, c1 + 1):
                u = col + 0.5
                if (
                    sign * ((b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0])) >= 0
                    and sign * ((c[0] - b[0]) * (v - b[1]) - (c[1] - b[1]) * (u - b[0])) >= 0
                    and sign * ((a[0] - c[0]) * (v - c[1]) - (a[1] - c[1]) * (u - c[0])) >= 0
                ):
                    mask[r, col] = True
