"""Small scenes for the reconstruction: closed shapes on the table, seen by perfect cameras."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import trimesh

from graspbench.arrays import FloatArray
from graspbench.perception.camera import Camera, Intrinsics
from graspbench.perception.silhouette import Silhouette
from tests.oracles.rasterise import exact_silhouettes, ring_of_cameras

# Half the usual resolution keeps the tests quick.
INTRINSICS = Intrinsics(320, 240, 290.0, 290.0, 160.0, 120.0)


@dataclass(frozen=True, eq=False)
class ShapeScene:
    mesh: trimesh.Trimesh
    centre: FloatArray
    silhouettes: tuple[Silhouette, ...]


@lru_cache
def scene(name: str, magnification: int = 1, **stations: int) -> ShapeScene:
    mesh = shape(name)
    mesh.apply_translation([0.0, 0.0, -mesh.bounds[0, 2]])
    centre = np.asarray(mesh.center_mass)
    cameras = ring_of_cameras(centre, intrinsics=INTRINSICS, **stations)
    silhouettes = exact_silhouettes(mesh.vertices, mesh.faces, cameras, magnification=magnification)
    return ShapeScene(mesh, centre, silhouettes)


def shape(name: str) -> trimesh.Trimesh:
    if name == "sphere":
        return trimesh.creation.icosphere(4, 0.04)
    if name == "egg":
        egg = trimesh.creation.icosphere(4, 0.03)
        egg.vertices[:, 2] *= 1.35
        egg.vertices[:, :2] *= 1.0 - 5.0 * egg.vertices[:, 2:]
        return egg
    if name == "bottle":
        outline = [[0, 0], [0.03, 0], [0.03, 0.1], [0.024, 0.115], [0.012, 0.125], [0.012, 0.16], [0, 0.16]]
        return trimesh.creation.revolve(np.array(outline), sections=64)
    if name == "mushroom":
        outline = [[0, 0], [0.012, 0], [0.012, 0.05], [0.035, 0.055], [0.035, 0.07], [0, 0.08]]
        return trimesh.creation.revolve(np.array(outline), sections=64)
    if name == "angle":
        arms = trimesh.creation.box((0.02, 0.1, 0.02)), trimesh.creation.box((0.07, 0.02, 0.03))
        arms[0].apply_translation((0.0, 0.05, 0.0))
        arms[1].apply_translation((0.035, 0.0, 0.005))
        return trimesh.boolean.union(arms, engine="manifold")
    if name == "torus":
        return trimesh.creation.torus(0.035, 0.012, major_sections=64, minor_sections=32)
    if name == "cup":
        return _cup()
    if name == "plate":
        plate = trimesh.creation.box((0.14, 0.07, 0.02))
        drills = [
            trimesh.creation.cylinder(0.018, 0.05).apply_translation((x, 0, 0)) for x in (-0.035, 0.035)
        ]
        return trimesh.boolean.difference([plate, *drills], engine="manifold")
    raise ValueError(name)


def _cup() -> trimesh.Trimesh:
    """Return a cup, open above, with a handle at its side."""
    outline = [[0, 0], [0.035, 0], [0.04, 0.08], [0.036, 0.08], [0.032, 0.005], [0, 0.005]]
    body = trimesh.creation.revolve(np.array(outline), sections=48)
    handle = trimesh.creation.torus(0.026, 0.006, major_sections=40, minor_sections=16)
    handle.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    handle.apply_translation((0.044, 0.0, 0.042))
    inside = trimesh.creation.cylinder(0.033, 0.12).apply_translation((0.0, 0.0, 0.065))
    handle = trimesh.boolean.difference([handle, inside], engine="manifold")
    return trimesh.boolean.union([body, handle], engine="manifold")


def moved(silhouettes: tuple[Silhouette, ...], transform: FloatArray) -> tuple[Silhouette, ...]:
    """Return the same images, taken by cameras that were moved rigidly."""
    return tuple(_replaced(s, transform @ s.camera.transform_camera_to_world) for s in silhouettes)


def scaled(silhouettes: tuple[Silhouette, ...], factor: float) -> tuple[Silhouette, ...]:
    """Return the same images, of a scene scaled about the world's origin."""
    out = []
    for silhouette in silhouettes:
        transform = silhouette.camera.transform_camera_to_world.copy()
        transform[:3, 3] *= factor
        out.append(_replaced(silhouette, transform))
    return tuple(out)


def _replaced(silhouette: Silhouette, transform: FloatArray) -> Silhouette:
    s = silhouette
    camera = Camera(s.camera.intrinsics, transform)
    return Silhouette(s.station, s.mask, s.box, s.centroid, camera, s.window, s.coverage)
