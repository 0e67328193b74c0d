"""Prisms over a plane outline, with rounded rims."""

from __future__ import annotations

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import hull_mesh
from graspbench.geometry.mesh import make_mesh, signed_volume

_RIM_PIECES = 4


def extruded_body(outline: FloatArray, height_m: float, rim_radius_m: float, step_m: float) -> Body:
    """Return the prism over an outline, standing on z = 0.

    Args:
        outline: Counter-clockwise corners of a simple polygon, shape (n, 2), m.
        height_m: Height.
        rim_radius_m: Rounding of the rims of bottom and top, at most the outline's own rounding.
        step_m: Largest height of a row of triangles.

    Raises:
        ConfigurationError: The rounding does not fit.
    """
    import manifold3d

    if 2.0 * rim_radius_m >= height_m:
        raise ConfigurationError(
            "the rims of a prism are rounder than half its height", remedy="use a smaller rim"
        )
    rows = _rows(height_m, rim_radius_m, step_m)
    rings = np.concatenate(
        [np.column_stack([inset(outline, depth), np.full(len(outline), z)]) for depth, z in rows]
    )
    cap = np.asarray(manifold3d.triangulate([inset(outline, rim_radius_m)]), dtype=np.int64)
    top = (len(rows) - 1) * len(outline)
    faces = np.concatenate([cap[:, ::-1], _side_faces(len(rows), len(outline)), cap + top])
    mesh = make_mesh(rings, faces)
    hull = hull_mesh(rings)
    convex = signed_volume(hull.vertices, hull.faces) < 1.0001 * signed_volume(rings, faces)
    return Body(mesh, (hull,) if convex else None)


def inset(outline: FloatArray, depth_m: float) -> FloatArray:
    """Move every side of a counter-clockwise polygon inwards by the same distance.

    Raises:
        ConfigurationError: A side would vanish.
    """
    if depth_m == 0.0:
        return outline
    sides = np.roll(outline, -1, axis=0) - outline
    directions = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    before = np.roll(directions, 1, axis=0)
    normals = np.stack([-directions[:, 1], directions[:, 0]], axis=1)  # to the left, so inwards
    before_normals = np.roll(normals, 1, axis=0)
    cosine = np.einsum("ij,ij->i", before, directions)
    moved: FloatArray = outline + depth_m * (normals + before_normals) / (1.0 + cosine)[:, None]
    if np.any(np.einsum("ij,ij->i", np.roll(moved, -1, axis=0) - moved, directions) <= 0.0):
        raise ConfigurationError(
            "the rims of a prism are rounder than its corners",
            remedy="use a smaller rim or larger corner radii",
        )
    return moved


def _rows(height_m: float, rim_m: float, step_m: float) -> list[tuple[float, float]]:
    """Return (inset, z) of each ring of vertices from bottom to top."""
    angles = np.linspace(0.0, math.pi / 2.0, _RIM_PIECES + 1) if rim_m > 0.0 else np.array([math.pi / 2.0])
    rim = [(rim_m * (1.0 - math.sin(a)), rim_m * (1.0 - math.cos(a))) for a in angles]
    straight = height_m - 2.0 * rim_m
    pieces = max(1, math.ceil(straight / step_m))
    middle = [(0.0, rim_m + straight * i / pieces) for i in range(1, pieces)]
    return [*rim, *middle, *((depth, height_m - z) for depth, z in reversed(rim))]


def _side_faces(rows: int, around: int) -> IntArray:
    low = (np.arange(rows - 1)[:, None] * around + np.arange(around)).ravel()
    following = (np.arange(rows - 1)[:, None] * around + (np.arange(around) + 1) % around).ravel()
    return np.concatenate(
        [
            np.stack([low, following, following + around], axis=1),
            np.stack([low, following + around, low + around], axis=1),
        ]
    )
