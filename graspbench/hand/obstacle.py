"""An object's surface as an obstacle: points in spatial blocks, so that most are never looked at."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from graspbench.arrays import FloatArray, IntArray

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


def make_obstacle(points: FloatArray) -> Obstacle:
    """Arrange points of a surface, shape (m, 3), in blocks."""
    if len(points) == 0:
        return Obstacle(np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(1, dtype=np.int64))
    order, starts = near_together(points, BLOCK_POINTS)
    ordered = np.ascontiguousarray(points[order])
    return Obstacle(ordered, balls_around(ordered, starts), starts)


def near_together(points: FloatArray, most: int) -> tuple[IntArray, IntArray]:
    """Order points, shape (m, 3), so that blocks of at most ``most`` are near together.

    Returns:
        Their order, shape (m,); first point of each block, and m, shape (b + 1,).
    """
    # A balanced tree halves the points again and again: so do the blocks.
    order = cKDTree(points, leafsize=most, compact_nodes=False).indices
    starts = np.array([0, len(points)])
    while np.diff(starts).max() > most:
        middles = (starts[:-1] + starts[1:]) // 2
        starts = np.sort(np.concatenate((starts, middles)))
    return order.astype(np.int64), starts.astype(np.int64)


def balls_around(points: FloatArray, starts: IntArray) -> FloatArray:
    """Return centre and radius of a ball around each block of points, shape (b, 4)."""
    low = np.minimum.reduceat(points, starts[:-1])
    high = np.maximum.reduceat(points, starts[:-1])
    centres = 0.5 * (low + high)
    gaps = points - np.repeat(centres, np.diff(starts), axis=0)
    radii = np.sqrt(np.maximum.reduceat(np.einsum("ij,ij->i", gaps, gaps), starts[:-1]))
    return np.column_stack((centres, radii))
