"""Triangle meshes for pictures: surfaces, balls and tubes with colours and vertex normals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from graspbench.reconstruction.network import SurfaceNetwork
    from graspbench.reconstruction.surface import Surface

Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Solid:
    """A mesh to draw.

    Attributes:
        points: Vertices in the world, shape (n, 3).
        normals: Outward unit normals, shape (n, 3).
        faces: Triangles, shape (m, 3).
        colors: Vertex colours from 0 to 1, shape (n, 3).
        edges: Whether the edge opposite each corner is drawn as a line, shape (m, 3).
    """

    points: FloatArray
    normals: FloatArray
    faces: IntArray
    colors: FloatArray
    edges: BoolArray


def surface_solid(surface: Surface, color: Rgb) -> Solid:
    """Return the reconstruction surface with its network drawn on it."""
    return Solid(
        surface.points,
        surface.normals,
        surface.network.faces,
        np.tile(color, (len(surface.points), 1)),
        network_edges(surface.network),
    )


def network_edges(network: SurfaceNetwork) -> BoolArray:
    """Tell which triangle edges are springs (the diagonals are not), shape (n_faces, 3)."""
    degree = np.diff(network.link_start)
    size = network.size
    linked = set((np.repeat(np.arange(size), degree) * size + network.link_nodes).tolist())
    faces = network.faces
    opposite = np.stack((faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]), axis=1)
    keys = opposite[..., 0] * size + opposite[..., 1]
    return np.isin(keys, np.fromiter(linked, dtype=np.int64))


def mesh_solid(points: FloatArray, faces: IntArray, color: Rgb) -> Solid:
    """Return a mesh drawn with one flat normal a triangle (for hands and other sharp bodies)."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return Solid(
        corners.reshape(-1, 3),
        np.repeat(normals, 3, axis=0),
        np.arange(3 * len(faces)).reshape(-1, 3),
        np.tile(color, (3 * len(faces), 1)),
        np.zeros((len(faces), 3), dtype=bool),
    )


def ball(centre: FloatArray, radius_m: float, color: Rgb) -> Solid:
    """Return a ball."""
    directions, faces = _unit_sphere()
    return Solid(
        np.asarray(centre) + radius_m * directions,
        directions,
        faces,
        np.tile(color, (len(directions), 1)),
        np.zeros(faces.shape, dtype=bool),
    )


def tube(line: FloatArray, radius_m: float, color: Rgb, sides: int = 10) -> Solid:
    """Return a round tube along a polyline, shape (n, 3), n >= 2; repeated points are dropped."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line = line[np.concatenate(([True], steps > 1e-7))]
    if len(line) < 2:
        return ball(line[0], radius_m, color)
    tangents = np.gradient(line, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    first = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    frames = [first / np.linalg.norm(first)]
    for tangent in tangents[1:]:  # parallel transport: the tube does not twist
        moved = frames[-1] - (frames[-1] @ tangent) * tangent
        frames.append(moved / max(float(np.linalg.norm(moved)), 1e-12))
    u = np.array(frames)
    v = np.cross(tangents, u)
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    normals = np.cos(angles)[None, :, None] * u[:, None] + np.sin(angles)[None, :, None] * v[:, None]
    points = (line[:, None] + radius_m * normals).reshape(-1, 3)
    i, k = np.meshgrid(np.arange(len(line) - 1), np.arange(sides), indexing="ij")
    a, b = i * sides + k, i * sides + (k + 1) % sides
    faces = np.concatenate(
        (
            np.stack((a, b, b + sides), axis=-1).reshape(-1, 3),
            np.stack((a, b + sides, a + sides), axis=-1).reshape(-1, 3),
        )
    )
    solid = Solid(
        points,
        normals.reshape(-1, 3),
        faces,
        np.tile(color, (len(points), 1)),
        np.zeros(faces.shape, dtype=bool),
    )
    return merge((solid, ball(line[0], radius_m, color), ball(line[-1], radius_m, color)))


def merge(solids: Iterable[Solid]) -> Solid:
    """Return several solids as one."""
    parts = list(solids)
    offsets = np.concatenate(([0], np.cumsum([len(part.points) for part in parts])))
    return Solid(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.faces + offset for part, offset in zip(parts, offsets[:-1], strict=True)]),
        np.concatenate([part.colors for part in parts]),
        np.concatenate([part.edges for part in parts]),
    )


@lru_cache(maxsize=1)
def _unit_sphere(meridians: int = 20, parallels: int = 9) -> tuple[FloatArray, IntArray]:
    polar = np.linspace(0.0, np.pi, parallels + 2)
    azimuth = np.linspace(0.0, 2.0 * np.pi, meridians, endpoint=False)
    t, p = np.meshgrid(polar, azimuth, indexing="ij")
    points = np.stack((np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)), axis=-1).reshape(-1, 3)
    j, i = np.meshgrid(np.arange(parallels + 1), np.arange(meridians), indexing="ij")
    a, b = j * meridians + i, j * meridians + (i + 1) % meridians
    faces = np.concatenate(
        (
            np.stack((a, a + meridians, b + meridians), axis=-1).reshape(-1, 3),
            np.stack((a, b + meridians, b), axis=-1).reshape(-1, 3),
        )
    )
    return points, faces
