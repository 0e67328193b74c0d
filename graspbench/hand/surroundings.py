"""An object's surface as a posture search meets it: as points, as a few of them, and as triangles."""

from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.obstacle import Obstacle, make_obstacle
from graspbench.hand.penetration import Triangles, triangles_of

GUIDE_POINTS = 200


class Surroundings(NamedTuple):
    """An object's surface in the world.

    Attributes:
        points: Points that clearances are measured to: its nodes and the centres of its faces.
        guide: Some of them, which guide the search.
        triangles: All of it, for the exact test of what was found.
    """

    points: Obstacle
    guide: Obstacle
    triangles: Triangles


def surroundings_of(points: FloatArray | None, faces: IntArray | None) -> Surroundings:
    """Prepare a surface: points, shape (m, 3), or none, and its triangles, shape (t, 3), if known."""
    vertices = np.zeros((0, 3)) if points is None else np.asarray(points, dtype=float).reshape(-1, 3)
    triangles = triangles_of(vertices, faces)
    centres = vertices[:0] if faces is None else triangles.balls[:, :3]
    known = make_obstacle(np.concatenate((vertices, centres)))
    stride = max(1, -(-len(known.points) // GUIDE_POINTS))
    return Surroundings(known, make_obstacle(known.points[::stride]), triangles)
