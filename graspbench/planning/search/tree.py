"""Clusters of surface nodes that are close in position and normal."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled


@dataclass(frozen=True, eq=False)
class ClusterTree:
    """A binary tree; cluster 0 is the root, a leaf holds one node.

    Attributes:
        children: Shape (n_clusters, 2); -1 for a leaf.
        span: Cluster k holds ``members[span[k, 0]:span[k, 1]]``, shape (n_clusters, 2).
        members: The given indices of the nodes in leaf order, shape (n,).
        arm: Centre of the arms (position from the centroid in torque lengths), shape (n_clusters, 3).
        arm_radius: Ball that holds the members' arms, shape (n_clusters,).
        normal: Mean normal, unit, shape (n_clusters, 3).
        normal_radius: Ball that holds the members' normals, shape (n_clusters,).
        leaves: The cluster that holds member k alone, shape (n,).
    """

    children: IntArray
    span: IntArray
    members: IntArray
    arm: FloatArray
    arm_radius: FloatArray
    normal: FloatArray
    normal_radius: FloatArray
    leaves: IntArray


def build_tree(arms: FloatArray, normals: FloatArray, normal_weight: float) -> ClusterTree:
    """Cluster nodes by halving along the widest feature.

    Args:
        arms: Positions from the centroid in torque lengths, shape (n, 3).
        normals: Unit normals, shape (n, 3).
        normal_weight: How much a unit of normal counts against a torque length of position.
    """
    features = np.hstack([arms, normal_weight * normals])
    members = np.arange(len(arms))
    children, spans = [[-1, -1]], [(0, len(arms))]
    stack = [0]
    while stack:
        cluster = stack.pop()
        start, end = spans[cluster]
        if end - start < 2:
            continue
        part = members[start:end]
        inside = features[part]
        axis = int(np.argmax(np.ptp(inside, axis=0)))
        members[start:end] = part[np.argsort(inside[:, axis], kind="stable")]
        middle = (start + end) // 2
        children[cluster] = [len(spans), len(spans) + 1]
        stack += [len(spans) + 1, len(spans)]
        spans += [(start, middle), (middle, end)]
        children += [[-1, -1], [-1, -1]]
    span = np.array(spans, dtype=np.int64)
    arm, arm_radius = _balls(arms[members], span)
    normal, normal_radius = _balls(normals[members], span, unit=True)
    alone = np.flatnonzero(span[:, 1] - span[:, 0] == 1)
    leaves = alone[np.argsort(span[alone, 0])]
    return ClusterTree(
        np.array(children, dtype=np.int64), span, members, arm, arm_radius, normal, normal_radius, leaves
    )


def _balls(points: FloatArray, span: IntArray, unit: bool = False) -> tuple[FloatArray, FloatArray]:
    """Return a ball around each cluster's points: its centre is the box's, or the mean direction."""
    centres, radii = np.empty((len(span), 3)), np.empty(len(span))
    _fill_balls(np.ascontiguousarray(points), span, unit, centres, radii)
    return centres, radii


@compiled
def _fill_balls(
    points: FloatArray, span: IntArray, unit: bool, centres: FloatArray, radii: FloatArray
) -> None:
    for k in range(span.shape[0]):
        start, end = span[k, 0], span[k, 1]
        square = 0.0
        for c in range(3):
            low, high, total = np.inf, -np.inf, 0.0
            for m in range(start, end):
                low, high = min(low, points[m, c]), max(high, points[m, c])
                total += points[m, c]
            centres[k, c] = total / (end - start) if unit else 0.5 * (low + high)
            square += centres[k, c] ** 2
        if unit:
            length = np.sqrt(square)
            for c in range(3):
                centres[k, c] = centres[k, c] / length if length > 1e-9 else points[start, c]
        largest = 0.0
        for m in range(start, end):
            square = 0.0
            for c in range(3):
                square += (points[m, c] - centres[k, c]) ** 2
            largest = max(largest, square)
        radii[k] = np.sqrt(largest)
