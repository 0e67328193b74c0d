"""Beyond the thesis: keep a moving network from folding over itself."""

from functools import lru_cache

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.reconstruction.network import SurfaceNetwork

SHARPEST_COSINE = -0.6
"""Neighbouring faces whose normals turn further than this cosine's angle are folded (127 deg)."""

RELAXATION = 0.3
"""Share of the way to its contour's mean that a folded node goes."""


def unfold(points: FloatArray, network: SurfaceNetwork) -> bool:
    """Draw the nodes of folded faces towards the middle of their contours, in place.

    Two faces that turn back onto each other pierce what is next to them before long.

    Args:
        points: Node positions, shape (n_s, 3).
        network: How they are linked.

    Returns:
        Whether there was any fold.
    """
    faces = _folded(points, network)
    if not faces.any():
        return False
    counts = np.diff(network.contour_start)[:, None]
    means = np.add.reduceat(points[network.contour_nodes], network.contour_start[:-1]) / counts
    nodes = np.unique(network.faces[faces])
    points[nodes] += RELAXATION * (means[nodes] - points[nodes])
    return True


def _folded(points: FloatArray, network: SurfaceNetwork) -> BoolArray:
    """Return which faces are folded onto a neighbour, shape (n_f,)."""
    corners = points[network.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    pairs = _neighbours(network)
    sharp = np.einsum("ij,ij->i", normals[pairs[:, 0]], normals[pairs[:, 1]]) < SHARPEST_COSINE
    folded = np.zeros(len(network.faces), dtype=np.bool_)
    folded[pairs[sharp]] = True
    return folded


@lru_cache(maxsize=32)
def _neighbours(network: SurfaceNetwork) -> IntArray:
    """Return the two faces at each edge, shape (n_edges, 2)."""
    edges = np.sort(network.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    pairs: IntArray = np.repeat(np.arange(len(network.faces)), 3)[order].reshape(-1, 2)
    return pairs
