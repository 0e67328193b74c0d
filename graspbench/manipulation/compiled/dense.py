"""Small dense factorisations, compiled: Cholesky, and LQ by Householder reflections.

A finger's systems have six rows or so: a call of LAPACK would take longer than the whole factorisation.
"""

import math

from numba import njit

from graspbench.arrays import FloatArray
from graspbench.compiled import inner


@njit(fastmath={"reassoc", "contract"}, no_cpython_wrapper=True, no_cfunc_wrapper=True)
def dot(a: FloatArray, b: FloatArray) -> float:
    """Return the dot product of two vectors."""
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@inner
def cholesky(a: FloatArray) -> None:
    """Factorise a positive definite matrix in place; its lower triangle becomes the factor."""
    for j in range(len(a)):
        pivot = a[j, j] - dot(a[j, :j], a[j, :j])
        a[j, j] = math.sqrt(max(pivot, 1e-300))
        for i in range(j + 1, len(a)):
            a[i, j] = (a[i, j] - dot(a[i, :j], a[j, :j])) / a[j, j]


@inner
def lower_solve(factor: FloatArray, x: FloatArray) -> None:
    """Solve L y = x in place."""
    for i in range(len(x)):
        total = x[i]
        for k in range(i):
            total -= factor[i, k] * x[k]
        x[i] = total / factor[i, i]


@inner
def upper_solve(factor: FloatArray, x: FloatArray) -> None:
    """Solve L^T y = x in place."""
    for i in range(len(x) - 1, -1, -1):
        x[i] /= factor[i, i]
        for k in range(i):
            x[k] -= factor[i, k] * x[i]


@inner
def lq(a: FloatArray, heads: FloatArray) -> None:
    """LQ factorisation by Householder reflections of the rows, in place, for m <= n.

    Row i keeps L in its first i + 1 entries and the reflector's tail behind; ``heads`` keeps the heads.
    """
    m, n = a.shape
    for i in range(m):
        square = 0.0
        for k in range(i, n):
            square += a[i, k] * a[i, k]
        length = math.sqrt(square)
        if length == 0.0 or i == n - 1:
            heads[i] = 0.0
            continue
        diagonal = -length if a[i, i] > 0.0 else length
        scale = 1.0 / math.sqrt(length * (length + abs(a[i, i])))  # reflector of squared length 2
        heads[i] = (a[i, i] - diagonal) * scale
        for k in range(i + 1, n):
            a[i, k] *= scale
        for r in range(i + 1, m):
            along = heads[i] * a[r, i]
            for k in range(i + 1, n):
                along += a[i, k] * a[r, k]
            a[r, i] -= along * heads[i]
            for k in range(i + 1, n):
                a[r, k] -= along * a[i, k]
        a[i, i] = diagonal


@inner
def apply_reflectors(a: FloatArray, heads: FloatArray, x: FloatArray) -> None:
    """Apply Q^T of the LQ factorisation to a vector of length n, in place."""
    m, n = a.shape
    for i in range(m - 1, -1, -1):
        along = heads[i] * x[i]
        for k in range(i + 1, n):
            along += a[i, k] * x[k]
        x[i] -= along * heads[i]
        for k in range(i + 1, n):
            x[k] -= along * a[i, k]
