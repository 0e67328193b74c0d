"""Upper bounds of a measure over all grasps that take one contact from each of n_f clusters.

Every bound comes from one test that is chosen at a representative grasp and valid for all of them:

* Q1^2 <= sum_i tr(A_i B) for any positive semidefinite B of trace one, where A_i = W_i W_i^T is contact i's
  share of M = G G^T; B are powers of the representative's inverse. The higher the power, the closer they come
  to its weakest direction; the lower, the better they serve its neighbours where two directions are about
  equally weak, as they are at most optima.
* Q2^2 = det(M) <= det(R) (tr(M R^-1) / d)^d for any positive definite R (arithmetic and geometric mean
  of the eigenvalues of M R^-1); R is the representative's G G^T.
* Q3 <= max_i h_i(u) for any unit u, h_i the support function of contact i's unit cone wrenches; u is the
  best of a table. A grasp with max_i h_i(u) <= 0 for some u is not force closure.

Each test is a sum or a maximum over the contacts, so its largest value over a tuple of clusters is found
cluster by cluster, over their members.
"""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner

Q1, Q2, Q3 = 0, 1, 2

DOUBLINGS = 8
"""Powers of the inverse that are tried for Q1: 1, 2, 4, ..."""


@compiled
def bound_tuples(
    tuples: IntArray,
    bounds: FloatArray,
    tree: IntArray,
    balls: FloatArray,
    table: FloatArray,
    size: int,
    grams: FloatArray,
    measure: int,
    minkowski: bool,
    limits: FloatArray,
    lower: float,
) -> None:
    """Lower the bounds of tuples of clusters; to -inf where no grasp meets the constraints.

    Args:
        tuples: Clusters of each tuple, shape (m, n_f).
        bounds: Known upper bounds, shape (m,); overwritten.
        tree: Children, first member and end of each cluster, shape (n_clusters, 4).
        balls: Centre and radius of each cluster's arms, shape (n_clusters, 4).
        table: Support of each cluster in each direction, shape (n_clusters, n_directions).
        size: Components of a wrench.
        grams: Packed upper triangles of A_i (off-diagonals doubled) in leaf order, shape (n, d (d + 1) / 2).
        measure: Q1, Q2 or Q3.
        minkowski: Q3 is that of the Minkowski sum: supports add up, where they are positive.
        limits: Largest distance of two contacts, and of their mean from the centroid, torque lengths.
        lower: A bound at or below this need not be exact.
    """
    n_f = tuples.shape[1]
    clusters = np.empty(n_f, np.int64)
    for m in range(tuples.shape[0]):
        for i in range(n_f):
            clusters[i] = tuples[m, i]
        if not within_limits(clusters, balls, limits):
            bounds[m] = -np.inf
            continue
        floor = max(lower, 0.0) if measure == Q3 else 0.0
        support = _table_bound(clusters, table, minkowski, floor)
        upper = bounds[m]
        if support <= floor:
            bounds[m] = -np.inf
            continue
        if measure == Q3:
            upper = min(upper, support)
        else:
            upper = _singular_bound(clusters, tree, grams, measure, size, lower, upper)
        bounds[m] = upper


@compiled
def largest_balls(clusters: IntArray, table: FloatArray, minkowski: bool, lower: float) -> FloatArray:
    """Return upper bounds of Q3 of tuples of clusters, shape (m,); at or below ``lower`` they are not exact.

    Args:
        clusters: Shape (m, n_f).
        table: Support of each cluster in each direction, shape (n_clusters, n_directions).
        minkowski: See `bound_tuples`.
        lower: See `bound_tuples`.
    """
    bounds = np.empty(clusters.shape[0])
    for m in range(clusters.shape[0]):
        bounds[m] = _table_bound(clusters[m], table, minkowski, lower)
    return bounds


@inner
def within_limits(clusters: IntArray, balls: FloatArray, limits: FloatArray) -> bool:
    """Tell whether some grasp of the clusters may meet the pair and centre limits."""
    n_f = clusters.shape[0]
    if limits[0] < np.inf:
        for i in range(n_f):
            for j in range(i):
                square = 0.0
                for k in range(3):
                    square += (balls[clusters[i], k] - balls[clusters[j], k]) ** 2
                if np.sqrt(square) - balls[clusters[i], 3] - balls[clusters[j], 3] > limits[0]:
                    return False
    if limits[1] < np.inf:
        square, slack = 0.0, 0.0
        for k in range(3):
            mean = 0.0
            for i in range(n_f):
                mean += balls[clusters[i], k]
            square += (mean / n_f) ** 2
        for i in range(n_f):
            slack += balls[clusters[i], 3]
        if np.sqrt(square) - slack / n_f > limits[1]:
            return False
    return True


@inner
def _table_bound(clusters: IntArray, table: FloatArray, minkowski: bool, floor: float) -> float:
    """Return the smallest support of the clusters' union over the table."""
    best = np.inf
    stop = max(floor, 0.0)
    for j in range(table.shape[1]):
        value, total = -np.inf, 0.0
        for i in range(clusters.shape[0]):
            support = table[clusters[i], j]
            value = max(value, support)
            total += max(support, 0.0)
        if minkowski:
            value = total
        if value < best:
            best = value
            if best <= stop:
                break
    return best


@inner
def member(tree: IntArray, clusters: IntArray, i: int) -> int:
    """Return a member that stands for cluster i; other ones where a cluster is in the tuple again."""
    start, end = tree[clusters[i], 2], tree[clusters[i], 3]
    many, order = 0, 0
    for j in range(clusters.shape[0]):
        if clusters[j] == clusters[i]:
            many += 1
            order += j < i
    return int(start + ((2 * order + 1) * (end - start)) // (2 * many))


@inner
def _singular_bound(
    clusters: IntArray, tree: IntArray, grams: FloatArray, measure: int, d: int, lower: float, bound: float
) -> float:
    """Return an upper bound of Q1 or Q2 by tests that come from powers of a representative's inverse."""
    factor, determinant = _representative_factor(clusters, tree, grams, d)
    test = inverse(factor)
    packed = np.empty(grams.shape[1])
    square = np.empty((d, d))
    for _ in range(1 if measure == Q2 else DOUBLINGS):
        k, trace = 0, 0.0
        for a in range(d):
            trace += test[a, a]
        scale = 1.0 if measure == Q2 else 1.0 / trace
        for a in range(d):
            for b in range(d):
                test[a, b] *= scale
                if b >= a:
                    packed[k] = test[a, b]
                    k += 1
        total = 0.0
        for i in range(clusters.shape[0]):
            largest = 0.0
            for node in range(tree[clusters[i], 2], tree[clusters[i], 3]):
                value = 0.0
                for k in range(packed.shape[0]):
                    value += grams[node, k] * packed[k]
                largest = max(largest, value)
            total += largest
        if measure == Q2:
            return float(min(bound, determinant * (total / d) ** (0.5 * d) * (1.0 + 1e-9)))
        bound = min(bound, np.sqrt(total) * (1.0 + 1e-9))
        if bound <= lower:
            break
        for a in range(d):
            for b in range(d):
                value = 0.0
                for k in range(d):
                    value += test[a, k] * test[k, b]
                square[a, b] = value
        test, square = square, test
    return bound


@inner
def _representative_factor(
    clusters: IntArray, tree: IntArray, grams: FloatArray, d: int
) -> tuple[FloatArray, float]:
    """Return the lower Cholesky factor of a regularised G G^T, and the root of its determinant."""
    packed = np.zeros(grams.shape[1])
    for i in range(clusters.shape[0]):
        node = member(tree, clusters, i)
        for k in range(grams.shape[1]):
            packed[k] += grams[node, k]
    factor = np.zeros((d, d))
    k, trace = 0, 0.0
    for a in range(d):
        for b in range(a, d):
            factor[b, a] = packed[k] if a == b else 0.5 * packed[k]
            k += 1
        trace += factor[a, a]
    root = 1.0
    for a in range(d):
        factor[a, a] += 1e-10 * trace
        for b in range(a, d):
            value = factor[b, a]
            for c in range(a):
                value -= factor[b, c] * factor[a, c]
            factor[b, a] = np.sqrt(max(value, 1e-12 * trace)) if a == b else value / factor[a, a]
        root *= factor[a, a]
    return factor, root


@inner
def inverse(factor: FloatArray) -> FloatArray:
    """Return the inverse of the matrix whose lower factor is given."""
    d = factor.shape[0]
    root = np.zeros((d, d))
    for a in range(d):
        root[a, a] = 1.0 / factor[a, a]
        for b in range(a):
            value = 0.0
            for k in range(b, a):
                value -= factor[a, k] * root[k, b]
            root[a, b] = value / factor[a, a]
    inverse = np.zeros((d, d))
    for a in range(d):
        for b in range(d):
            for c in range(max(a, b), d):
                inverse[a, b] += root[c, a] * root[c, b]
    return inverse
