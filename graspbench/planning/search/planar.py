"""Upper bounds for the planar wrench spaces, which depend on each grasp's plane.

All grasps of a tuple of clusters have planes within some angle of one plane, which follows from how far their
contacts can be from the clusters' centres. The least rotation from that plane to a grasp's own turns the
grasp's wrenches into those that its contacts, turned back by as much, have in the fixed plane. So it is
enough to measure in the fixed plane, and to add what turning each normal and each arm by the angle can
change. Then the tests are those of `graspbench.planning.search.bounds`: a sum or a maximum over the contacts.
"""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.search.bounds import Q1, Q3, member, within_limits
from graspbench.planning.search.planar_frames import contact_plane
from graspbench.planning.search.planar_singular import singular_bound, singular_value
from graspbench.planning.search.planar_supports import least_support, support_bound
from graspbench.planning.search.planar_wrenches import contact_wrenches


@compiled
def bound_planar(
    tuples: IntArray,
    bounds: FloatArray,
    tree: IntArray,
    balls: FloatArray,
    caps: FloatArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    limits: FloatArray,
    lower: float,
) -> None:
    """Lower the bounds of tuples of clusters; to -inf where no grasp is force closure within the limits.

    Args:
        tuples: Clusters of each tuple, shape (m, n_f).
        bounds: Known upper bounds, shape (m,); overwritten.
        tree: Children, first member and end of each cluster, shape (n_clusters, 4).
        balls: Centre and radius of each cluster's arms, shape (n_clusters, 4).
        caps: Largest trace of any member's share of G G^T, shape (n_clusters,).
        arms: From the centroid, in torque lengths, in leaf order, shape (n, 3).
        normals: Inward unit normals in leaf order, shape (n, 3).
        vertices: Corners of the contact polytope, shape (n_v, n_basis).
        directions: Unit directions of the wrench space, shape (n_directions, d).
        measure: Q1, Q2 or Q3.
        minkowski: Q3 is that of the Minkowski sum.
        limits: Largest distance of two contacts, and of their mean from the centroid, torque lengths.
        lower: A bound at or below this need not be exact.
    """
    n_f, d = tuples.shape[1], directions.shape[1]
    clusters = np.empty(n_f, np.int64)
    frame, centres = np.empty((3, 3)), np.empty((n_f, 3))
    wrenches = np.empty((n_f * vertices.shape[0], d))
    for m in range(tuples.shape[0]):
        error, total = 0.0, 0.0
        for i in range(n_f):
            clusters[i] = tuples[m, i]
            error += balls[clusters[i], 3] ** 2
            total += caps[clusters[i]]
            for k in range(3):
                centres[i, k] = balls[clusters[i], k]
        if not within_limits(clusters, balls, limits):
            bounds[m] = -np.inf
            continue
        turn = contact_plane(centres, math.sqrt(error), frame)
        for i in range(n_f):
            node = member(tree, clusters, i)
            contact_wrenches(frame, normals[node], arms[node], vertices, wrenches, i)
        floor = max(lower, 0.0) if measure == Q3 else 0.0
        support = support_bound(
            clusters, tree, frame, turn, arms, normals, vertices, directions, wrenches, minkowski, floor
        )
        if support <= floor:
            bounds[m] = -np.inf
        elif measure == Q3:
            bounds[m] = min(bounds[m], support * (1.0 + 1e-9))
        else:
            cap = math.sqrt(total / d) if measure == Q1 else (total / d) ** (0.5 * d)
            bounds[m] = min(bounds[m], cap * (1.0 + 1e-9))
            if bounds[m] > lower:
                bounds[m] = singular_bound(
                    clusters,
                    tree,
                    frame,
                    turn,
                    arms,
                    normals,
                    vertices.shape[1],
                    d,
                    measure,
                    lower,
                    bounds[m],
                )


@compiled
def planar_grasps(
    tuples: IntArray,
    tree: IntArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    lower: float,
    grasps: IntArray,
    bounds: FloatArray,
) -> tuple[int, int]:
    """List the single grasps of tuples of clusters that may be better than a known one.

    Args:
        tuples: Clusters of each tuple, shape (m, n_f), equal ones side by side.
        tree: See `bound_planar`, as what follows.
        arms: Shape (n, 3).
        normals: Shape (n, 3).
        vertices: Shape (n_v, n_basis).
        directions: Shape (n_directions, d).
        measure: Q1, Q2 or Q3.
        minkowski: Q3 is that of the Minkowski sum.
        lower: The known value.
        grasps: Written: leaves of each grasp, shape (at least the grasps of any one tuple, n_f).
        bounds: Written: upper bound of each grasp's value, shape (same,).

    Returns:
        How many tuples were finished before the lists were full, and how many grasps are listed.
    """
    n_f, d, n_v = tuples.shape[1], directions.shape[1], vertices.shape[0]
    chosen = np.empty(n_f, np.int64)
    frame, wrenches, gram = np.empty((3, 3)), np.empty((n_f * n_v, d)), np.empty((d, d))
    found = 0
    for m in range(tuples.shape[0]):
        room = 1
        for i in range(n_f):
            room *= tree[tuples[m, i], 3] - tree[tuples[m, i], 2]
        if found + room > grasps.shape[0]:
            return m, found
        depth = 0
        chosen[0] = tree[tuples[m, 0], 2] - 1
        while depth >= 0:
            chosen[depth] += 1
            if chosen[depth] >= tree[tuples[m, depth], 3]:
                depth -= 1
                continue
            if depth + 1 < n_f:
                depth += 1
                same = tuples[m, depth] == tuples[m, depth - 1]
                chosen[depth] = chosen[depth - 1] if same else tree[tuples[m, depth], 2] - 1
                continue
            value = _promise(
                chosen, arms, normals, vertices, directions, measure, minkowski, lower, frame, wrenches, gram
            )
            if value > max(lower, 0.0):
                for i in range(n_f):
                    grasps[found, i] = chosen[i]
                bounds[found] = value
                found += 1
    return tuples.shape[0], found


@compiled
def planar_promise(
    grasps: IntArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    lower: float,
    promised: FloatArray,
) -> None:
    """Write upper bounds of single grasps' values, shape (m,); grasps are leaves, shape (m, n_f)."""
    n_f, d, n_v = grasps.shape[1], directions.shape[1], vertices.shape[0]
    chosen = np.empty(n_f, np.int64)
    frame, wrenches, gram = np.empty((3, 3)), np.empty((n_f * n_v, d)), np.empty((d, d))
    for m in range(grasps.shape[0]):
        for i in range(n_f):
            chosen[i] = grasps[m, i]
        promised[m] = _promise(
            chosen, arms, normals, vertices, directions, measure, minkowski, lower, frame, wrenches, gram
        )


@inner
def _promise(
    chosen: IntArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    lower: float,
    frame: FloatArray,
    wrenches: FloatArray,
    gram: FloatArray,
) -> float:
    """Return an upper bound of a single grasp's value; not positive where it is not force closure."""
    n_f, d = chosen.shape[0], directions.shape[1]
    points = np.empty((n_f, 3))
    for i in range(n_f):
        for k in range(3):
            points[i, k] = arms[chosen[i], k]
    value = np.inf
    if contact_plane(points, 1e-9, frame) > 1e-3:
        return value  # its plane depends on its normals, or on rounding
    if measure != Q3:
        value = singular_value(chosen, frame, arms, normals, vertices.shape[1], d, measure, gram)
        if value <= lower:
            return value
    edges = vertices.shape[0] // 2 if vertices.shape[1] == 4 else vertices.shape[0]
    if edges % 2 == 1 and vertices.shape[1] > 1:
        return value + 1e-7 * abs(value)  # the first edge of an odd pyramid depends on the plane's sign
    for i in range(n_f):
        contact_wrenches(frame, normals[chosen[i]], arms[chosen[i]], vertices, wrenches, i)
    reach = least_support(wrenches, n_f, directions, minkowski, max(lower, 0.0) if measure == Q3 else 0.0)
    if measure == Q3 or reach <= 0.0:
        value = reach
    return value + 1e-7 * abs(value)
