"""The Mirtich-Canny criterion: largest outer triangle within thresholds (thesis appendix A).

With the projected normals 120 + e_j degrees apart, sum of e_j = 0 and sum of |e_j| <= 3 Phi_EEGI, the three
lines at distances h_j from the centroid bound a triangle that consists of three kites. A kite's area is
convex in its angle, so the largest triangle for given h_j is found at a corner of the hexagon of
allowed e. Distances and the coplanarity error follow from a representative and how far the members of the
clusters can be from it; once the clusters hold few grasps these are all evaluated.
"""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.epsilon import smallest_support
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores, score_contacts
from graspbench.planning.search.layout import Layout, single_grasps

FEW = 64


class OuterTriangleObjective:
    """Area of the outer triangle, m^2, of grasps with three contacts.

    Args:
        layout: The problem.
        thresholds_deg: Largest coplanarity and equilateral errors, deg.
    """

    few = 1

    def __init__(self, layout: Layout, thresholds_deg: tuple[float, float]) -> None:
        self._layout = layout
        self._limits = layout.limits
        self._thresholds = np.deg2rad(np.array(thresholds_deg))
        tree, rho = layout.tree, layout.torque_length
        self._normals = np.hstack([tree.normal, tree.normal_radius[:, None]])
        self._balls = layout.balls * rho
        self._points = layout.points - layout.centroid

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """See `graspbench.planning.search.objectives.Objective`."""
        bound_triangles(
            tuples, bounds, self._layout.branches, self._balls, self._normals, self._points,
            self._layout.normals_in, self._limits, self._thresholds, lower,
        )  # fmt: skip

    def candidates(self, tuples: IntArray, lower: float) -> tuple[IntArray, FloatArray]:
        """See `graspbench.planning.search.objectives.Objective`."""
        return single_grasps(self._layout, tuples)

    def promise(self, tuples: IntArray) -> FloatArray:
        """See `graspbench.planning.search.objectives.Objective`."""
        layout = self._layout
        cei, eegi, area = mirtich_canny_scores(layout.points[tuples], layout.normals_in[tuples])
        limits = np.rad2deg(self._thresholds)
        return np.where((cei <= limits[0]) & (eegi <= limits[1]), area, -np.inf)

    def evaluate(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `graspbench.planning.search.objectives.Objective`."""
        layout = self._layout
        values = self.promise(tuples)
        chosen = values > lower
        values[~chosen] = -np.inf
        polytope = layout.quality.polytope()
        wrenches = polytope.vertices @ np.swapaxes(layout.grasp_maps(tuples[chosen]), -1, -2)
        open_ = smallest_support(wrenches, polytope, stop_at=CLOSURE_TOLERANCE) <= CLOSURE_TOLERANCE
        values[np.flatnonzero(chosen)[open_]] = -np.inf
        return values


@compiled
def bound_triangles(
    tuples: IntArray,
    bounds: FloatArray,
    tree: IntArray,
    balls: FloatArray,
    normal_balls: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    limits: FloatArray,
    thresholds: FloatArray,
    lower: float,
) -> None:
    """Lower the bounds of triples of clusters; to -inf where no grasp meets thresholds and limits.

    Args:
        tuples: Clusters of each triple, shape (m, 3).
        bounds: Known upper bounds, shape (m,), m^2; overwritten.
        tree: Children, first member and end of each cluster, shape (n_clusters, 4).
        balls: Centre and radius of each cluster's points from the centroid, shape (n_clusters, 4), m.
        normal_balls: Mean and radius of each cluster's normals, shape (n_clusters, 4).
        points: Nodes in leaf order, from the centroid, shape (n, 3), m.
        normals: Inward unit normals in leaf order, shape (n, 3).
        limits: Largest distance of two contacts, and of their mean from the centroid, m.
        thresholds: Largest coplanarity and equilateral errors, rad.
        lower: A bound at or below it need not be exact.
    """
    p = np.empty((3, 3))
    n = np.empty((3, 3))
    radius = np.empty(3)
    turn = np.empty(3)
    height = np.empty(3)
    for m in range(tuples.shape[0]):
        many = 1
        same = False
        for i in range(3):
            cluster = tuples[m, i]
            many *= tree[cluster, 3] - tree[cluster, 2]
            same = same or (i > 0 and cluster == tuples[m, i - 1])
            for k in range(3):
                p[i, k] = balls[cluster, k]
                n[i, k] = normal_balls[cluster, k]
            radius[i] = balls[cluster, 3]
            turn[i] = 2.0 * np.arcsin(min(1.0, 0.5 * normal_balls[cluster, 3]))
        far, away, slack = 0.0, 0.0, 0.0
        for i in range(3):
            j = (i + 1) % 3
            gap = 0.0
            for k in range(3):
                gap += (p[i, k] - p[j, k]) ** 2
            far = max(far, np.sqrt(gap) - radius[i] - radius[j])
            away += ((p[0, i] + p[1, i] + p[2, i]) / 3.0) ** 2
            slack += radius[i] / 3.0
        if far > limits[0] or np.sqrt(away) - slack > limits[1]:
            bounds[m] = -np.inf
            continue
        if many <= FEW and not same:
            best = _best_of_few(tuples, m, tree, points, normals, thresholds, p, n, height)
            bounds[m] = min(bounds[m], best)
            continue
        _heights(p, n, radius, turn, thresholds[0], height)
        if height[0] == -np.inf:
            bounds[m] = -np.inf
        else:
            bounds[m] = min(bounds[m], _largest_area(height, thresholds[1]))


@inner
def _best_of_few(
    tuples: IntArray,
    m: int,
    tree: IntArray,
    points: FloatArray,
    normals: FloatArray,
    thresholds: FloatArray,
    p: FloatArray,
    n: FloatArray,
    scores: FloatArray,
) -> float:
    """Return the largest triangle of a triple's grasps within the thresholds; -inf if there is none."""
    best = -np.inf
    for a in range(tree[tuples[m, 0], 2], tree[tuples[m, 0], 3]):
        for b in range(tree[tuples[m, 1], 2], tree[tuples[m, 1], 3]):
            for c in range(tree[tuples[m, 2], 2], tree[tuples[m, 2], 3]):
                for k in range(3):
                    p[0, k], p[1, k], p[2, k] = points[a, k], points[b, k], points[c, k]
                    n[0, k], n[1, k], n[2, k] = normals[a, k], normals[b, k], normals[c, k]
                score_contacts(p, n, scores)
                error = max(scores[0] - np.rad2deg(thresholds[0]), scores[1] - np.rad2deg(thresholds[1]))
                if error <= 1e-9 and scores[2] > best:
                    best = scores[2]
    return best * (1.0 + 1e-9)


@inner
def _heights(
    p: FloatArray, n: FloatArray, radius: FloatArray, turn: FloatArray, cei: float, height: FloatArray
) -> None:
    """Write upper bounds of the lines' distances from the centroid; -inf if no normals are coplanar."""
    plane = np.empty(3)
    size, change = 0.0, 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        plane[k] = (p[1, a] - p[0, a]) * (p[2, b] - p[0, b]) - (p[1, b] - p[0, b]) * (p[2, a] - p[0, a])
        size += plane[k] ** 2
    size = np.sqrt(size)
    for i in range(1, 3):
        edge = 0.0
        for k in range(3):
            edge += (p[i, k] - p[0, k]) ** 2
        other = 3 - i
        change += np.sqrt(edge) * (radius[0] + radius[other])
    change += (radius[0] + radius[1]) * (radius[0] + radius[2])
    known = change < size
    swing = np.arcsin(min(1.0, change / size)) if known else 0.5 * np.pi
    total = 0.0
    for i in range(3):
        out = 0.0
        for k in range(3):
            out += n[i, k] * plane[k] / size if known else 0.0
        tilt = abs(np.arcsin(max(-1.0, min(1.0, out))))
        total += max(0.0, tilt - swing - turn[i])
        reach, along, offset = 0.0, 0.0, 0.0
        for k in range(3):
            reach += p[i, k] ** 2
            along += n[i, k] * p[i, k]
            offset += plane[k] * p[i, k]
        reach = np.sqrt(reach) + radius[i]
        largest = min(tilt + swing + turn[i], 3.0 * cei)
        # The height is |n . p - (n . plane) (p . plane)| / cos(tilt), and |p . plane| at most the reach.
        largest = min(largest, 1.5)
        # How far the plane can be from the centroid, by its normal's swing and the point's move.
        off = (
            min(reach, abs(offset) / size + radius[i] + 2.0 * reach * np.sin(0.5 * swing)) if known else reach
        )
        flat = abs(along) + radius[i] + 2.0 * reach * np.sin(0.5 * turn[i]) + off * np.sin(largest)
        height[i] = min(reach, flat / np.cos(largest))
    if total > 3.0 * cei:
        height[0] = -np.inf


@inner
def _largest_area(height: FloatArray, eegi: float) -> float:
    """Return the largest triangle of three lines at most so far from a point inside."""
    step = 1.5 * eegi
    best = 0.0
    for i in range(3):
        for sign in (-1.0, 1.0):
            area = 0.0
            for j in range(3):
                angle = 2.0 * np.pi / 3.0
                if j == i:
                    angle += sign * step
                elif j == (i + 1) % 3:
                    angle -= sign * step
                a, b = height[(j + 1) % 3], height[(j + 2) % 3]
                area += (2.0 * a * b - (a * a + b * b) * np.cos(angle)) / (2.0 * np.sin(angle))
            best = max(best, area)
    return best * (1.0 + 1e-9)
