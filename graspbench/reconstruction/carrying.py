"""From one snapshot to the next, whose network may be another."""

import numpy as np
from scipy.spatial import KDTree

from graspbench.arrays import IntArray
from graspbench.reconstruction.surface import Surface

NORMAL_SHARE = 0.2
"""How much a turned normal counts against a distance: a right angle as 0.28 mean radii."""


def carry_over(vertices: IntArray, before: Surface, now: Surface) -> IntArray:
    """Return the nodes of a snapshot that continue nodes of another one.

    On one network a node stays itself. Else it is continued by the nearest node that faces the same way;
    contacts of one grasp stay different.

    Args:
        vertices: Nodes of ``before``, all different, shape (n_f,).
        before: The snapshot they belong to.
        now: The snapshot they are wanted on.
    """
    if before.network is now.network:
        return vertices
    scale = NORMAL_SHARE * float(np.linalg.norm(now.points - now.centroid, axis=1).mean())
    gaps = now.points[None] - before.points[vertices][:, None]
    turns = now.normals[None] - before.normals[vertices][:, None]
    costs = np.einsum("fni,fni->fn", gaps, gaps) + scale**2 * np.einsum("fni,fni->fn", turns, turns)
    carried = np.empty_like(vertices)
    for i in range(len(vertices)):
        carried[i] = np.argmin(costs[i])
        costs[i + 1 :, carried[i]] = np.inf
    return carried


def mean_distance(before: Surface, now: Surface) -> float:
    """Return how far a snapshot's nodes are on average from where they are on another one (m).

    Between different networks it is the distance to the other one's nearest nodes.
    """
    if before.network is now.network:
        return float(np.linalg.norm(now.points - before.points, axis=1).mean())
    return float(np.mean(KDTree(now.points).query(before.points)[0]))
