"""A first good grasp for the search to beat."""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.planning.search.layout import Layout
from graspbench.planning.search.objectives import Objective
from graspbench.reconstruction.network import SurfaceNetwork

SAMPLES = 4096
TRIED = {2: 256, 3: 128, 4: 48}


def first_grasps(
    layout: Layout, objective: Objective, network: SurfaceNetwork, n_f: int, limits: FloatArray, count: int
) -> list[IntArray]:
    """Sample grasps and climb from the best ones along the surface's contours, without the hand.

    Args:
        layout: The problem.
        objective: What to climb.
        network: Contours of the surface's nodes.
        n_f: Number of contacts.
        limits: Largest distance of two contacts, and of their mean from the centroid, m; shape (2,).
        count: Number of climbs.

    Returns:
        Leaves of the grasps that were reached, best first.
    """
    rng = np.random.default_rng(0)
    if len(layout.nodes) < n_f:
        return []
    samples = rng.integers(0, len(layout.nodes), size=(SAMPLES, n_f))
    samples = samples[meets_limits(layout, samples, limits)][: TRIED.get(n_f, 24)]
    values = objective.evaluate(samples, -np.inf)
    leaf_of = np.full(network.size, -1, dtype=np.int64)
    leaf_of[layout.nodes] = np.arange(len(layout.nodes))
    reached: dict[tuple[int, ...], float] = {}
    for k in np.argsort(-values, kind="stable")[:count]:
        if values[k] > -np.inf:
            grasp, value = _climb(layout, objective, network, leaf_of, limits, samples[k], float(values[k]))
            reached[tuple(sorted(grasp.tolist()))] = value
    return [np.array(grasp) for grasp in sorted(reached, key=lambda g: -reached[g])]


def _climb(
    layout: Layout,
    objective: Objective,
    network: SurfaceNetwork,
    leaf_of: IntArray,
    limits: FloatArray,
    grasp: IntArray,
    value: float,
) -> tuple[IntArray, float]:
    while True:
        moves = []
        for i, leaf in enumerate(grasp):
            around = leaf_of[network.contour(layout.nodes[leaf])]
            for neighbour in around[around >= 0]:
                move = grasp.copy()
                move[i] = neighbour
                moves.append(move)
        tuples = np.array(moves, dtype=np.int64).reshape(-1, len(grasp))
        tuples = tuples[meets_limits(layout, tuples, limits)]
        values = objective.evaluate(tuples, value)
        if not len(values) or values.max() <= value * (1.0 + 1e-9):
            return grasp, value
        best = int(np.argmax(values))
        grasp, value = tuples[best], float(values[best])


def meets_limits(layout: Layout, tuples: IntArray, limits: FloatArray) -> BoolArray:
    """Tell which grasps (leaves, shape (m, n_f)) have different contacts that meet the limits; shape (m,)."""
    points = layout.points[tuples]
    gaps = np.linalg.norm(points[:, :, None] - points[:, None, :], axis=-1)
    away = np.linalg.norm(points.mean(axis=1) - layout.centroid, axis=1)
    ordered = np.sort(tuples, axis=1)
    different = np.all(ordered[:, 1:] != ordered[:, :-1], axis=1)
    return np.asarray(different & (gaps.max(axis=(1, 2)) <= limits[0]) & (away <= limits[1]))
