"""One level of a hierarchical QP: least squares within limits, in the null space of the levels above."""

import math

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import inner
from graspbench.manipulation.compiled.dense import (
    apply_reflectors,
    cholesky,
    dot,
    lower_solve,
    lq,
    upper_solve,
)
from graspbench.manipulation.compiled.least_distance import least_distance
from graspbench.manipulation.compiled.limit_arrays import FAR, LimitArrays, is_admissible

_TIE = 1e-7
_RANK = 1e-8


@inner
def solve_level(matrix: FloatArray, wanted: FloatArray, free: FloatArray, limits: LimitArrays) -> bool:
    """Move x along the rows of ``free`` to the least |matrix x - wanted|^2 inside the limits.

    Ties go to the velocity that is nearest to the projected one; the second pass is a step of the proximal
    point method, which takes the tie's bias out of weak directions. Without a matrix the tie is all.

    Returns:
        Whether there is such a point; if not, x stays.
    """
    d, x = len(free), limits.x
    if d == 0:
        return is_admissible(limits)
    along, missing = np.empty((len(matrix), d)), np.empty(len(matrix))
    for i in range(len(matrix)):
        missing[i] = wanted[i] - dot(matrix[i], x)
        for r in range(d):
            along[i, r] = dot(matrix[i], free[r])
    tie = _TIE if len(matrix) > 0 else 1.0
    factor, target = np.zeros((d, d)), np.empty(d)
    for r in range(d):
        for s in range(r + 1):
            for i in range(len(matrix)):
                factor[r, s] += along[i, r] * along[i, s]
        factor[r, r] += tie
        target[r] = 0.0
        for v in range(len(x)):
            target[r] += free[r, v] * (limits.near[v] - x[v])
    cholesky(factor)
    sides, bounds, lengths = _sides(free, factor, limits)
    best, away = np.empty(d), np.empty(d)
    for _ in range(2 if len(matrix) > 0 else 1):
        for r in range(d):
            best[r] = tie * target[r]
            for i in range(len(matrix)):
                best[r] += along[i, r] * missing[i]
        lower_solve(factor, best)
        # in w = L^T (y - best) the level asks for the least |w|
        least = np.empty(len(sides))
        for j in range(len(sides)):
            least[j] = bounds[j] / lengths[j] - dot(sides[j], best)
        if not least_distance(sides, least, away):
            return False
        for r in range(d):
            target[r] = best[r] + away[r]
        upper_solve(factor, target)
    for r in range(d):
        for v in range(len(x)):
            x[v] += free[r, v] * target[r]
    return True


@inner
def _sides(
    free: FloatArray, factor: FloatArray, limits: LimitArrays
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit normals of all limits in w, their bounds from x on, and the normals' lengths before."""
    d, x, rows = len(free), limits.x, limits.rows
    room = 2 * len(x) + len(rows)
    sides, bounds, lengths, count = np.empty((room, d)), np.empty(room), np.empty(room), 0
    normal = np.empty(d)
    for j in range(len(x) + len(rows)):
        for r in range(d):
            normal[r] = free[r, j] if j < len(x) else dot(rows[j - len(x)], free[r])
        lower_solve(factor, normal)
        length = math.sqrt(dot(normal, normal))
        if length < 1e-10:
            continue
        for sign in range(1, -2, -2):
            if j < len(x):
                bound = limits.low[j] - x[j] if sign > 0 else x[j] - limits.high[j]
                open_end = bound < -0.5 * FAR
            else:
                bound, open_end = limits.least[j - len(x)] - dot(rows[j - len(x)], x), sign < 0
            if not open_end:
                for r in range(d):
                    sides[count, r] = sign * normal[r] / length
                bounds[count], lengths[count] = bound, length
                count += 1
    return sides[:count], bounds[:count], lengths[:count]


@inner
def null_directions(matrix: FloatArray, free: FloatArray) -> FloatArray:
    """Return orthonormal rows that span those directions of ``free`` that the matrix does not see."""
    d, n = free.shape
    along, kept, size = np.empty((len(matrix), d)), 0, 0.0
    for i in range(len(matrix)):
        for r in range(d):
            along[i, r] = dot(matrix[i], free[r])
        size = max(size, dot(along[i], along[i]))
    independent = np.empty((min(len(matrix), d), d))
    used = np.zeros(len(matrix), dtype=np.int64)
    while kept < len(independent):
        pivot, longest = -1, _RANK * _RANK * size
        for i in range(len(matrix)):
            if used[i] == 0 and dot(along[i], along[i]) > longest:
                pivot, longest = i, dot(along[i], along[i])
        if pivot < 0:
            break
        used[pivot] = 1
        independent[kept] = along[pivot] / math.sqrt(longest)
        kept += 1
        for i in range(len(matrix)):
            if used[i] == 0:
                part = dot(along[i], independent[kept - 1])
                for r in range(d):
                    along[i, r] -= part * independent[kept - 1, r]
    heads = np.zeros(kept)
    lq(independent[:kept], heads)
    out, direction = np.zeros((d - kept, n)), np.empty(d)
    for r in range(d - kept):
        direction[:] = 0.0
        direction[kept + r] = 1.0
        apply_reflectors(independent[:kept], heads, direction)
        for s in range(d):
            for v in range(n):
                out[r, v] += direction[s] * free[s, v]
    return out
