"""Bodies that planners know, wrapped around the points of a mesh: a box or a capsule, and its convex hull."""

from functools import lru_cache

import numpy as np
import pinocchio
import scipy.spatial

from graspbench.arrays import FloatArray
from graspbench.hand.distance import BOX, SEGMENT
from graspbench.hand.hulls import Hull, extreme_points, hull_of

Wrap = tuple[int, FloatArray, float, pinocchio.SE3]
"""Kind of the core, its half extents, shape (3,), the radius that it is swept by, and its placement."""

_DIRECTIONS = 60
"""Directions whose extreme points tell how the box is turned; all points tell how large it is."""


def wrap_mesh(vertices: FloatArray, *, fine: bool = False) -> tuple[Wrap, Hull | None] | None:
    """Return the smaller of the least box and the capsule around a mesh, and its hull; None for a flat mesh.

    Args:
        vertices: Its vertices, shape (n, 3), m.
        fine: Whether the hull is to be a fine one (``hull_of``).
    """
    return _wrapped(np.ascontiguousarray(vertices, dtype=float).tobytes(), fine)


@lru_cache(maxsize=256)
def _wrapped(data: bytes, fine: bool) -> tuple[Wrap, Hull | None] | None:
    """Wrap a mesh once: fingers are often copies of each other, and a hand is loaded more than once."""
    import trimesh  # here: it takes long to load, and many hands have no meshes

    vertices = np.frombuffer(data).reshape(-1, 3)
    try:
        to_box, _ = trimesh.bounds.oriented_bounds(extreme_points(vertices, _DIRECTIONS))
    except (scipy.spatial.QhullError, ValueError):
        return None
    axes = np.linalg.inv(to_box)[:3, :3]
    order = np.argsort(np.ptp(vertices @ axes, axis=0), kind="stable")  # z along the longest edge
    axes = axes[:, order]
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] = -axes[:, 0]
    low, high = (vertices @ axes).min(axis=0), (vertices @ axes).max(axis=0)
    placement = pinocchio.SE3(np.ascontiguousarray(axes), axes @ (0.5 * (low + high)))
    local, half = vertices @ axes - 0.5 * (low + high), 0.5 * (high - low)
    wrap: Wrap = (BOX, half, 0.0, placement)
    radius = float(np.linalg.norm(local[:, :2], axis=1).max())
    within = np.sqrt(np.maximum(radius**2 - np.sum(local[:, :2] ** 2, axis=1), 0.0))
    length = max(float((np.abs(local[:, 2]) - within).max()), 0.0)
    if np.pi * radius**2 * (2.0 * length + 4.0 / 3.0 * radius) < 8.0 * float(np.prod(half)):
        wrap = (SEGMENT, np.array([0.0, 0.0, length]), radius, placement)
    return wrap, hull_of(local, fine=fine)
