"""Singular values of G in the plane of a frame: Q1 and Q2 of a grasp, and bounds of them."""

import math
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.planning.search.bounds import Q1, Q2, inverse, member
from graspbench.planning.search.planar_wrenches import planar_wrench

_LEAST = 1e-12

POWERS = 5
"""Powers of the inverse that are tried for Q1: 1, 2, 4, ..."""


@inner
def _add_gram(frame: FloatArray, normal: FloatArray, arm: FloatArray, n_basis: int, gram: FloatArray) -> None:
    """Add a contact's share to G G^T in the plane of a frame."""
    d = gram.shape[0]
    column, force = np.empty(d), np.empty(3)
    for c in range(n_basis):
        twist = 0.0
        for k in range(3):
            # With friction any three directions across each other are as good as the tangents and the normal.
            force[k] = normal[k] if n_basis == 1 else frame[c, k] if c < 3 else 0.0
            twist += normal[k] * frame[2, k] if c == 3 else 0.0
        planar_wrench(frame, force, arm, twist, column)
        for a in range(d):
            for b in range(d):
                gram[a, b] += column[a] * column[b]


@inner
def singular_value(
    chosen: IntArray,
    frame: FloatArray,
    arms: FloatArray,
    normals: FloatArray,
    n_basis: int,
    d: int,
    measure: int,
    gram: FloatArray,
) -> float:
    """Return Q1 or Q2 of a grasp."""
    gram[:] = 0.0
    for i in range(chosen.shape[0]):
        _add_gram(frame, normals[chosen[i]], arms[chosen[i]], n_basis, gram)
    if d == 2:
        mean = 0.5 * (gram[0, 0] + gram[1, 1])
        gap = math.hypot(0.5 * (gram[0, 0] - gram[1, 1]), gram[0, 1])
        if measure == Q1:
            return math.sqrt(max(mean - gap, 0.0))
        return math.sqrt(max(gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2, 0.0))
    values = np.linalg.eigvalsh(gram)
    if measure == Q1:
        return math.sqrt(max(values[0], 0.0))
    return math.sqrt(max(values[0] * values[1] * values[2], 0.0))


@inner
def singular_bound(
    clusters: IntArray,
    tree: IntArray,
    frame: FloatArray,
    turn: float,
    arms: FloatArray,
    normals: FloatArray,
    n_basis: int,
    d: int,
    measure: int,
    lower: float,
    bound: float,
) -> float:
    """Return an upper bound of Q1 or Q2 by tests that come from powers of a representative's inverse."""
    gram = np.zeros((d, d))
    for i in range(clusters.shape[0]):
        node = member(tree, clusters, i)
        _add_gram(frame, normals[node], arms[node], n_basis, gram)
    trace = 0.0
    for a in range(d):
        trace += gram[a, a]
    # Any positive definite matrix gives a bound; contacts that push across the plane leave nothing but zeros.
    factor: Any = np.linalg.cholesky(gram + max(1e-6 * trace, _LEAST) * np.eye(d))
    root = 1.0
    for a in range(d):
        root *= factor[a, a]
    test = inverse(factor)
    square, share = np.empty((d, d)), np.empty((d, d))
    for _ in range(1 if measure == Q2 else POWERS):
        trace, norm = 0.0, 0.0
        for a in range(d):
            trace += test[a, a]
        for a in range(d):
            for b in range(d):
                test[a, b] = test[a, b] if measure == Q2 else test[a, b] / trace
                norm += test[a, b] ** 2
        stretch = math.sqrt(math.sqrt(norm))  # no less than the root of the largest eigenvalue
        total = 0.0
        for i in range(clusters.shape[0]):
            largest = 0.0
            for node in range(tree[clusters[i], 2], tree[clusters[i], 3]):
                share[:] = 0.0
                _add_gram(frame, normals[node], arms[node], n_basis, share)
                value, reach = 0.0, 0.0
                for a in range(d):
                    for b in range(d):
                        value += test[a, b] * share[a, b]
                for k in range(3):
                    reach += arms[node, k] ** 2
                change = (1.0 if n_basis != 3 and (n_basis == 1 or d == 3) else 0.0) + (
                    reach if d == 3 else 0.0
                )
                largest = max(largest, math.sqrt(max(value, 0.0)) + stretch * turn * math.sqrt(change))
            total += largest * largest
        if measure == Q2:
            return float(min(bound, root * (total / d) ** (0.5 * d) * (1.0 + 1e-9)))
        bound = min(bound, math.sqrt(total) * (1.0 + 1e-9))
        if bound <= lower:
            break
        for a in range(d):
            for b in range(d):
                value = 0.0
                for k in range(d):
                    value += test[a, k] * test[k, b]
                square[a, b] = value
        test, square = square, test
    return float(bound)
