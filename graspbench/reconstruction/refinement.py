"""Beyond the thesis: a surface that also follows what the centroid cannot see.

A node pulled to one centre stops at the first border it meets, so the surface hangs over
everything behind an overhang or in a fold. The refinement slides nodes to where the surface hangs, pulls
them along the surface's normals, and draws the nearest nodes to uncovered parts of the border.
"""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from scipy.spatial import KDTree

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry.intersections import self_intersections
from graspbench.reconstruction.border import sample_border
from graspbench.reconstruction.network import SurfaceNetwork
from graspbench.reconstruction.regulation import NEAR_M, hanging, regulate, uncovered
from graspbench.reconstruction.solid import vertex_normals
from graspbench.reconstruction.unfolding import unfold
from graspbench.reconstruction.visual_hull import VisualHull

SLIDING = 0.1
"""Share of the way to its contour's weighted mean that a node slides in a step."""

ATTRACTION_PER_M = 1e4
"""How strongly links that hang off the hull gather nodes."""

DRAW = 0.5
"""Share of the way to an uncovered part of the border that the nearest node goes in a step."""

WORST_SHARE = 0.5
"""Parts of the border farther from the surface than this share of the farthest one draw a node."""

SAMPLES_PER_LINK = 1.5
CANDIDATES = 4
LONGEST_STEP_M = 1e-3

FINE_SHARE = 0.2
"""A distance to the hull that is this share of a link is as good as flat faces can be."""

PATIENCE = 40
"""Steps without an improvement that end the refinement."""

UNFOLDING_ROUNDS = 2


def refine(
    hull: VisualHull, points: FloatArray, network: SurfaceNetwork, max_steps: int
) -> Iterator[FloatArray]:
    """Move a surface that rests on the hull into the hull's hidden parts.

    Args:
        hull: The visual hull.
        points: Nodes at rest on it, shape (n_s, 3).
        network: How they are linked.
        max_steps: Steps after which it ends anyway.

    Yields:
        The best surface so far, shape (n_s, 3): the one with the smallest two-sided distance to the
        hull. Ends when that distance is a small share of the links or has stopped shrinking; the last one
        is the best that does not cross itself, if there is any.
    """
    link_m = _mean_link(points, network)
    samples = sample_border(hull, points.min(axis=0), points.max(axis=0), link_m / SAMPLES_PER_LINK)
    face_start, node_faces = _faces_around(network)
    current, moved = points.copy(), np.empty_like(points)
    worst, pulls = np.empty(len(points)), np.empty_like(points)
    improvements: list[FloatArray] = []
    smallest, waited = np.inf, 0
    for step in range(max_steps):
        if step:
            _move(current, moved, hull, network)
        nearest = np.asarray(KDTree(current).query(samples, k=CANDIDATES)[1], dtype=np.int64)
        missed = uncovered(current, network.faces, face_start, node_faces, samples, nearest, worst, pulls)
        gap = max(missed, hanging(current, network.faces, hull.fields))
        waited += 1
        if gap < smallest:
            smallest, waited = gap, 0
            improvements.append(current.copy())
        yield improvements[-1]
        if smallest < FINE_SHARE * link_m or waited >= PATIENCE:
            break
        drawn = worst > WORST_SHARE * missed
        current[drawn] += DRAW * pulls[drawn]
    yield _best_uncrossed(improvements, network)


def _move(points: FloatArray, moved: FloatArray, hull: VisualHull, network: SurfaceNetwork) -> None:
    """Slide the nodes, pull them to the hull, and smooth out folds."""
    _regulate(points, moved, hull, network, SLIDING, NEAR_M)
    for _ in range(2):
        _regulate(points, moved, hull, network, 0.0, np.inf)
    for _ in range(UNFOLDING_ROUNDS):
        if not unfold(points, network):
            break
        _regulate(points, moved, hull, network, 0.0, np.inf)


def _best_uncrossed(improvements: list[FloatArray], network: SurfaceNetwork) -> FloatArray:
    """Return the last surface that does not cross itself; the very last if all do."""
    for points in reversed(improvements):
        if not self_intersections(points, network.faces).any():
            return points
    return improvements[-1]


def _regulate(
    points: FloatArray,
    moved: FloatArray,
    hull: VisualHull,
    network: SurfaceNetwork,
    sliding: float,
    near_m: float,
) -> None:
    regulate(
        points,
        vertex_normals(points, network),
        moved,
        hull.fields,
        network.contour_start,
        network.contour_nodes,
        sliding,
        ATTRACTION_PER_M,
        LONGEST_STEP_M,
        near_m,
    )


def _mean_link(points: FloatArray, network: SurfaceNetwork) -> float:
    tails = np.repeat(np.arange(network.size), np.diff(network.link_start))
    return float(np.linalg.norm(points[network.link_nodes] - points[tails], axis=1).mean())


@lru_cache(maxsize=32)
def _faces_around(network: SurfaceNetwork) -> tuple[IntArray, IntArray]:
    """Return the faces around each node as offsets and one flat array."""
    corners = network.faces.ravel()
    order = np.argsort(corners, kind="stable")
    start = np.searchsorted(corners[order], np.arange(network.size + 1))
    return start.astype(np.int64), (order // 3).astype(np.int64)
