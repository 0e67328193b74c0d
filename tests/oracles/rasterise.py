"""Exact silhouettes of triangle meshes from the thesis' stations, without renderer or physics."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.bench.exact_silhouettes import exact_silhouettes as exact
from graspbench.bench.exact_silhouettes import rasterise as rasterise
from graspbench.perception.camera import Camera, Intrinsics
from graspbench.perception.silhouette import Silhouette


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


def exact_silhouettes(
    vertices: FloatArray, faces: IntArray, cameras: dict[str, Camera], *, magnification: int = 1
) -> tuple[Silhouette, ...]:
    """Rasterise a mesh, in world coordinates, from every camera."""
    return exact(vertices, faces, list(cameras.values()), list(cameras), magnification=magnification)
