"""Support of every cluster's unit cone wrenches in a fixed set of directions."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.planning.search.polar import weak_direction
from graspbench.planning.search.tree import ClusterTree


def even_directions(count: int, size: int) -> FloatArray:
    """Return fixed unit directions of a space: its axes and a seeded uniform sample, shape (n, size)."""
    directions = np.random.default_rng(2010).normal(size=(count, size))
    directions = np.vstack([np.eye(size), -np.eye(size), directions])
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def support_table(tree: ClusterTree, wrenches: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the largest support of any member of each cluster in each direction.

    Args:
        tree: Clusters of the n nodes.
        wrenches: Unit cone wrenches of each node in leaf order, shape (n, n_vertices, d).
        directions: Shape (n_directions, d).

    Returns:
        Shape (n_clusters, n_directions).
    """
    table = np.empty((len(tree.span), len(directions)))
    _fill(tree.children, tree.span, wrenches, directions, table)
    return table


@compiled
def weaken_directions(wrenches: FloatArray, grasps: IntArray, directions: FloatArray) -> None:
    """Turn the direction of each grasp to a weak one, shape (m, d), in place."""
    n_f, (_, n_v, d) = grasps.shape[1], wrenches.shape
    grasp = np.empty((n_f * n_v, d))
    for m in range(grasps.shape[0]):
        for i in range(n_f):
            for v in range(n_v):
                for k in range(d):
                    grasp[i * n_v + v, k] = wrenches[grasps[m, i], v, k]
        weak_direction(grasp, n_f * n_v, directions[m])


@compiled
def _fill(
    children: IntArray, span: IntArray, wrenches: FloatArray, directions: FloatArray, table: FloatArray
) -> None:
    for cluster in range(len(span) - 1, -1, -1):
        left, right = children[cluster, 0], children[cluster, 1]
        if left >= 0:
            for j in range(directions.shape[0]):
                table[cluster, j] = max(table[left, j], table[right, j])
            continue
        node = span[cluster, 0]
        for j in range(directions.shape[0]):
            best = -np.inf
            for v in range(wrenches.shape[1]):
                value = 0.0
                for k in range(directions.shape[1]):
                    value += wrenches[node, v, k] * directions[j, k]
                best = max(best, value)
            table[cluster, j] = best
