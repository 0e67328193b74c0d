"""An object's surface as an obstacle: points in spatial blocks, so that most are never looked at."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled

BLOCK_POINTS = 32


class Obstacle(NamedTuple):
    """Points of an object's surface in the world, near ones together.

    Attributes:
        points: Shape (m, 3).
        blocks: Centre and radius of a ball around each block of points, shape (b, 4).
        starts: First point of each block, and m, shape (b + 1,).
    """

    points: FloatArray
    blocks: FloatArray
    starts: IntArray


def make_obstacle(points: FloatArray | None) -> Obstacle:
    """Arrange points of a surface, shape (m, 3), in blocks; None and no points are no obstacle."""
    if points is None or len(points) == 0:
        return Obstacle(np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(1, dtype=np.int64))
    # A balanced tree halves the points again and again: so do the blocks.
    tree = cKDTree(points, leafsize=BLOCK_POINTS)
    ordered = np.ascontiguousarray(tree.data[tree.indices])
    starts = np.array([0, len(points)])
    while np.diff(starts).max() > BLOCK_POINTS:
        middles = (starts[:-1] + starts[1:]) // 2
        starts = np.sort(np.concatenate((starts, middles)))
    low = np.minimum.reduceat(ordered, starts[:-1])
    high = np.maximum.reduceat(ordered, starts[:-1])
    centres = 0.5 * (low + high)
    gaps = ordered - np.repeat(centres, np.diff(starts), axis=0)
    radii = np.sqrt(np.maximum.reduceat(np.einsum("ij,ij->i", gaps, gaps), starts[:-1]))
    return Obstacle(ordered, np.column_stack((centres, radii)), starts.astype(np.int64))


@compiled
def outside(obstacle: Obstacle, centres: FloatArray, radius: float) -> BoolArray:
    """Tell which balls hold no point of the obstacle.

    Args:
        obstacle: The obstacle.
        centres: Centres of the balls in the world, shape (n, 3).
        radius: Their radius.

    Returns:
        Shape (n,).
    """
    free = np.ones(len(centres), dtype=np.bool_)
    for i in range(len(centres)):
        x, y, z = centres[i, 0], centres[i, 1], centres[i, 2]
        for b in range(len(obstacle.blocks)):
            block = obstacle.blocks[b]
            reach = radius + block[3]
            if (x - block[0]) ** 2 + (y - block[1]) ** 2 + (z - block[2]) ** 2 >= reach * reach:
                continue
            for k in range(obstacle.starts[b], obstacle.starts[b + 1]):
                p = obstacle.points[k]
                if (x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2 < radius * radius:
                    free[i] = False
            if not free[i]:
                break
    return free
