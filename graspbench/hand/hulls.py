"""Convex hulls of meshes with few corners and planes, for compiled distances to ground and object."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.spatial

from graspbench.arrays import FloatArray
from graspbench.hand.directions import even_directions

_MAX_CORNERS, _CORNER_DIRECTIONS, _PLANE_DIRECTIONS = 150, 500, 26
_FACETS, _APART = 30, np.cos(np.radians(12.0))
_FILL_APART = np.cos(np.radians(18.0))
_FINE_FACETS, _FINE_APART = 400, np.cos(np.radians(6.0))


class Hull(NamedTuple):
    """A convex hull from inside and from outside.

    Attributes:
        corners: Its corners; of many, those that are extreme in some of 500 directions, shape (v, 3), m.
        planes: Outward unit normals and offsets of planes that touch it: those of its largest facets, and
            others in between, shape (p, 4), m.
    """

    corners: FloatArray
    planes: FloatArray


def hull_of(vertices: FloatArray, *, fine: bool = False) -> Hull | None:
    """Return a mesh's convex hull; None for a flat mesh.

    Args:
        vertices: Its vertices, shape (n, 3), m.
        fine: Keep all corners, and planes wherever they differ by 6 deg: of a fingertip 15 mm round the
            hull of these planes then stands out by some hundredths of a millimetre.
    """
    try:
        hull = scipy.spatial.ConvexHull(vertices)
    except (scipy.spatial.QhullError, ValueError):
        return None
    corners = vertices[hull.vertices]
    kept = corners if fine or len(corners) <= _MAX_CORNERS else extreme_points(corners, _CORNER_DIRECTIONS)
    normals: list[FloatArray] = []
    # Triangles of one facet have one normal: their areas count together.
    rounded, first, group = np.unique(
        np.round(hull.equations[:, :3], 3), axis=0, return_index=True, return_inverse=True
    )
    facets, apart = (_FINE_FACETS, _FINE_APART) if fine else (_FACETS, _APART)
    a, b, c = np.moveaxis(vertices[hull.simplices], 1, 0)
    areas = np.bincount(group.ravel(), np.linalg.norm(np.cross(b - a, c - a), axis=1), len(rounded))
    for i in np.argsort(-areas, kind="stable"):
        normal = hull.equations[first[i], :3]
        if len(normals) < facets and all(normal @ other < apart for other in normals):
            normals.append(normal)
    for direction in even_directions(_PLANE_DIRECTIONS):
        if all(direction @ other < _FILL_APART for other in normals):
            normals.append(direction)
    planes = np.array(normals)
    offsets = (planes @ corners.T).max(axis=1)
    return Hull(np.ascontiguousarray(kept), np.column_stack((planes, offsets)))


def extreme_points(points: FloatArray, directions: int) -> FloatArray:
    """Return the points that are extreme in some of many directions, shape (m, 3)."""
    return np.asarray(points[np.unique(np.argmax(even_directions(directions) @ points.T, axis=1))])


def stacked(hulls: Sequence[Hull | None]) -> dict[str, Any]:
    """Return all hulls' corners and planes one after the other, and where those of each are."""
    nothing = Hull(np.zeros((0, 3)), np.zeros((0, 4)))
    known = [nothing if hull is None else hull for hull in hulls]
    ends = np.cumsum([(len(hull.corners), len(hull.planes)) for hull in known], axis=0)
    starts = np.vstack((np.zeros((1, 2), dtype=np.int64), ends[:-1]))
    return {
        "corners": np.concatenate([nothing.corners, *(hull.corners for hull in known)]),
        "planes": np.concatenate([nothing.planes, *(hull.planes for hull in known)]),
        "spans": np.column_stack((starts[:, 0], ends[:, 0], starts[:, 1], ends[:, 1])).astype(np.int64),
    }
