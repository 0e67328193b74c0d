"""Points on the surfaces of collision shapes."""

from typing import Any

import coal
import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.directions import even_directions

_SPHERE = 200


def surface_points(shape: Any) -> FloatArray:
    """Return points that span a shape of the collision library, in its own frame, shape (n, 3).

    Of boxes the corners and points between them, of meshes the vertices, of round shapes points all over.
    """
    if isinstance(shape, coal.Box):
        steps = np.linspace(-1.0, 1.0, 5)
        grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        return np.asarray(grid[np.abs(grid).max(axis=1) == 1.0] * np.asarray(shape.halfSide).ravel())
    if isinstance(shape, coal.Sphere):
        return np.asarray(shape.radius * even_directions(_SPHERE))
    if isinstance(shape, (coal.Capsule, coal.Cylinder)):
        angles = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        ring = shape.radius * np.column_stack((np.cos(angles), np.sin(angles), 0.0 * angles))
        rings = [ring + np.array([0.0, 0.0, share * shape.halfLength]) for share in np.linspace(-1.0, 1.0, 7)]
        if isinstance(shape, coal.Capsule):
            ball = shape.radius * even_directions(_SPHERE)
            rings += [ball + np.array([0.0, 0.0, side * shape.halfLength]) for side in (-1.0, 1.0)]
        return np.concatenate(rings)
    if hasattr(shape, "vertices"):
        return np.asarray(shape.vertices(), dtype=float).reshape(-1, 3)
    shape.computeLocalAABB()
    box = shape.aabb_local
    low, high = np.asarray(box.min_, dtype=float), np.asarray(box.max_, dtype=float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    return np.asarray(low + corners * (high - low))
