"""How narrow an object is."""

import numpy as np
from scipy.spatial import ConvexHull

from graspbench.arrays import FloatArray


def smallest_width(points: FloatArray) -> float:
    """Return the width of a point set in the direction in which it is narrowest, m.

    The narrowest direction of a convex polyhedron is a face normal or normal to two edges; the faces alone
    are close enough to tell an object from a hand's span.
    """
    hull = ConvexHull(points)
    extents = points[hull.vertices] @ np.unique(hull.equations[:, :3].round(9), axis=0).T
    return float((extents.max(axis=0) - extents.min(axis=0)).min())
