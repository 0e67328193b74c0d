"""Solids of revolution about the z axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import hull_mesh
from graspbench.geometry.mesh import make_mesh

if TYPE_CHECKING:
    import trimesh

SEGMENTS = 64
"""Facets around the axis: they stay within 0.12 % of the radius of the true surface."""

_SLICE_TOLERANCE_M = 3e-4
"""How far a convex slice may bulge out of a concave profile: well below a fingertip's radius."""


def revolved_body(profile: FloatArray, segments: int = SEGMENTS) -> Body:
    """Return the solid swept by a profile, with its convex slices where the profile rises all along.

    Args:
        profile: Points (r, z), shape (k, 2), m, from the axis below to the axis above, r > 0 in between.
        segments: Facets around the axis.

    Raises:
        ConfigurationError: The profile does not start and end on the axis, or touches it in between.
    """
    mesh = surface_of_revolution(profile, segments)
    if np.all(np.diff(profile[:, 1]) > -1e-9):
        return Body(mesh, convex_slices(profile, segments))
    return Body(mesh, None)


def surface_of_revolution(profile: FloatArray, segments: int = SEGMENTS) -> trimesh.Trimesh:
    """Return the closed surface swept by a profile; arguments and errors as :func:`revolved_body`."""
    if profile[0, 0] != 0.0 or profile[-1, 0] != 0.0 or np.any(profile[1:-1, 0] <= 0.0):
        raise ConfigurationError(
            "the profile of a solid of revolution must start and end on the axis and stay off it in between",
            remedy="give r = 0 to its first and last corner only",
        )
    rings = _rings(profile[1:-1], segments)
    poles = np.array([[0.0, 0.0, profile[0, 1]], [0.0, 0.0, profile[-1, 1]]])
    return make_mesh(np.concatenate([poles, rings]), ring_faces(len(profile) - 2, segments))


def convex_slices(profile: FloatArray, segments: int = SEGMENTS) -> tuple[trimesh.Trimesh, ...]:
    """Cut a solid of revolution with a rising profile across its axis into the fewest convex slices.

    Args:
        profile: Points (r, z), shape (k, 2), z never falling, m.
        segments: Facets around the axis.
    """
    slices = []
    start = 0
    while (start := _past_ledge(profile, start)) < len(profile) - 1:
        end = _furthest_convex(profile, start)
        outline = _concave_envelope(profile[start : end + 1])
        off_axis = outline[outline[:, 0] > 0.0]
        on_axis = [[0.0, 0.0, z] for r, z in outline if r == 0.0]
        points = np.concatenate([_rings(off_axis, segments), np.array(on_axis).reshape(-1, 3)])
        slices.append(hull_mesh(points))
        start = end
    return tuple(slices)


def _furthest_convex(profile: FloatArray, start: int) -> int:
    end = start + 1
    while end + 1 < len(profile) and _bulge(profile[start : end + 2]) <= _SLICE_TOLERANCE_M:
        end += 1
    return end


def _bulge(piece: FloatArray) -> float:
    """Return how far the convex hull of a slice reaches beyond its profile."""
    envelope = _concave_envelope(piece)
    bottom, top = piece[0, 1], piece[-1, 1]
    if top - bottom <= 0.0:
        return 0.0
    inner = piece[(piece[:, 1] > bottom) & (piece[:, 1] < top)]
    beyond = np.interp(inner[:, 1], envelope[:, 1], envelope[:, 0]) - inner[:, 0]
    # Where a ledge leads outwards at the top, the hull fills the corner under it.
    rim = piece[piece[:, 1] == top, 0]
    return max(float(beyond.max(initial=0.0)), float(rim.max() - rim[0]))


def _past_ledge(profile: FloatArray, start: int) -> int:
    """Skip a flat step inwards: the slice above it begins at its inner edge."""
    while start < len(profile) - 1:
        (r0, z0), (r1, z1) = profile[start], profile[start + 1]
        if z1 - z0 > 1e-9 or r1 > r0:
            break
        start += 1
    return start


def _concave_envelope(points: FloatArray) -> FloatArray:
    """Return the corners of the smallest concave function of z above the points (r, z)."""
    hull: list[FloatArray] = []
    for point in points:
        while len(hull) >= 2:
            (r0, z0), (r1, z1) = hull[-2], hull[-1]
            if (r1 - r0) * (point[1] - z0) > (point[0] - r0) * (z1 - z0) + 1e-15:
                break
            hull.pop()
        hull.append(point)
    return np.array(hull)


def _rings(profile: FloatArray, segments: int) -> FloatArray:
    angles = 2.0 * np.pi * np.arange(segments) / segments
    radius, height = profile[:, :1], profile[:, 1:]
    rings = np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.broadcast_to(height, (len(profile), segments))],
        axis=-1,
    )
    return rings.reshape(-1, 3)


def ring_faces(rings: int, segments: int) -> IntArray:
    """Return the triangles between two poles (vertices 0 below, 1 above) and rings of vertices from 2 on."""
    around = np.arange(segments)
    following = (around + 1) % segments
    bottom, top = 2, 2 + (rings - 1) * segments
    faces = [
        np.stack([np.zeros_like(around), bottom + following, bottom + around], axis=1),
        np.stack([np.ones_like(around), top + around, top + following], axis=1),
    ]
    for ring in range(rings - 1):
        low = 2 + ring * segments
        high = low + segments
        faces.append(np.stack([low + around, low + following, high + following], axis=1))
        faces.append(np.stack([low + around, high + following, high + around], axis=1))
    return np.concatenate(faces)
