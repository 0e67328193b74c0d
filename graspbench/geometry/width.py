"""How narrow an object is."""

import numpy as np
from scipy.spatial import ConvexHull

from graspbench.arrays import FloatArray

_AT_ONCE = 64
"""Normals whose heights are in memory together."""


def smallest_width(points: FloatArray) -> float:
    """Return the width of a point set in the direction in which it is narrowest, m.

    The narrowest direction of a convex polyhedron is a face normal or normal to two edges; the faces alone
    are close enough to tell an object from a hand's span.
    """
    hull = ConvexHull(points)
    corners, normals = points[hull.vertices].T, np.unique(hull.equations[:, :3].round(9), axis=0)
    narrowest = np.inf
    for first in range(0, len(normals), _AT_ONCE):  # a ball has thousands of either
        heights = normals[first : first + _AT_ONCE] @ corners
        narrowest = min(narrowest, float((heights.max(axis=1) - heights.min(axis=1)).min()))
    return narrowest
