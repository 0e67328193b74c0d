"""Prioritised velocities by augmented projection, compiled (thesis 4.10 to 4.13).

z' = Jt^+ b + N_o J_a^+ w_a + N_oa J_b^+ w_b + ..., each task projected on the null space of all before
it. A task of activation h takes the share h of its own velocity, and the share h of its directions
away from the tasks below it: so z' is continuous when a task enters or leaves smoothly.

Redundancy is resolved in an explicit orthonormal basis Z of the main task's null space, from LQ
factorisations of the extended Jacobian: what a secondary task adds has no part in the main task, to
rounding, whatever the damping. Fingers that share no joints are factorised one by one.
"""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.manipulation.dense import apply_reflectors, cholesky, dot, lower_solve, lq, upper_solve

_TASK_DAMPING = 1e-4
_PROJECTOR_DAMPING = 1e-2


@inner
def transposed_velocity(jacobian: FloatArray, wanted: FloatArray, scale: FloatArray, out: FloatArray) -> None:
    """Write the transpose algorithm's velocity in the scaled variables (4.12)."""
    out[:] = 0.0
    for i in range(jacobian.shape[0]):
        for k in range(jacobian.shape[1]):
            out[k] += jacobian[i, k] * scale[k] * wanted[i]


@inner
def damping_factor(smallest: float, threshold: float, largest: float) -> float:
    """Return what is added to the singular values' squares: nothing away from a singularity."""
    if smallest >= threshold:
        return 0.0
    ratio = smallest / threshold
    return largest**2 * (1.0 - ratio * ratio)


@inner
def factorise(
    rows: IntArray,
    row_starts: IntArray,
    columns: IntArray,
    column_starts: IntArray,
    jacobian: FloatArray,
    scale: FloatArray,
    factors: FloatArray,
    heads: FloatArray,
    work: FloatArray,
) -> float:
    """Factorise the scaled Jacobian group by group; return the smallest singular value's estimate."""
    at, smallest = 0, math.inf
    for group in range(len(row_starts) - 1):
        first, left = row_starts[group], column_starts[group]
        m, n = row_starts[group + 1] - first, column_starts[group + 1] - left
        if m == 0:
            continue
        factor = factors[at : at + m * n].reshape((m, n))
        for i in range(m):
            for k in range(n):
                column = columns[left + k]
                factor[i, k] = jacobian[rows[first + i], column] * scale[column]
        lq(factor, heads[first:])
        smallest = min(smallest, _smallest_singular_value(factor, work[:m]))
        at += m * n
    return smallest


@inner
def _smallest_singular_value(factor: FloatArray, x: FloatArray) -> float:
    """Estimate the smallest singular value of L by inverse iteration; exact 0 if it is singular."""
    for i in range(len(x)):
        if abs(factor[i, i]) < 1e-12:
            return 0.0
        x[i] = 1.0 + 0.1 * math.cos(3.0 * i)
    value = 0.0
    for _ in range(3):
        lower_solve(factor, x)
        upper_solve(factor, x)
        growth = math.sqrt(dot(x, x))
        for i in range(len(x)):
            x[i] /= growth
        value = 1.0 / math.sqrt(growth)
    return value


@inner
def main_velocity(
    rows: IntArray,
    row_starts: IntArray,
    columns: IntArray,
    column_starts: IntArray,
    factors: FloatArray,
    heads: FloatArray,
    damping: float,
    wanted: FloatArray,
    work: FloatArray,
    out: FloatArray,
) -> None:
    """Write the pseudo-inverse's velocity in the scaled variables, damped near a singularity."""
    at = 0
    for group in range(len(row_starts) - 1):
        first, left = row_starts[group], column_starts[group]
        m, n = row_starts[group + 1] - first, column_starts[group + 1] - left
        factor, x = factors[at : at + m * n].reshape((m, n)), work[:n]
        x[:] = 0.0
        for i in range(m):
            x[i] = wanted[rows[first + i]]
        if damping > 0.0:
            _damped_lower_solve(factor, damping, x[:m])
        else:
            lower_solve(factor, x[:m])
        apply_reflectors(factor, heads[first:], x)
        for k in range(n):
            out[columns[left + k]] = x[k]
        at += m * n


@inner
def _damped_lower_solve(factor: FloatArray, damping: float, y: FloatArray) -> None:
    """Replace y by L^T (L L^T + damping I)^-1 y."""
    m = len(factor)
    gram = np.empty((m, m))
    for i in range(m):
        for k in range(i + 1):
            gram[i, k] = dot(factor[i, : k + 1], factor[k, : k + 1])
        gram[i, i] += damping
    cholesky(gram)
    lower_solve(gram, y)
    upper_solve(gram, y)
    for i in range(m):  # top down: entry i needs the entries from i on
        total = 0.0
        for k in range(i, m):
            total += factor[k, i] * y[k]
        y[i] = total


@inner
def null_basis(
    row_starts: IntArray,
    columns: IntArray,
    column_starts: IntArray,
    factors: FloatArray,
    heads: FloatArray,
    work: FloatArray,
    basis: FloatArray,
) -> None:
    """Write an orthonormal basis of the scaled Jacobian's null space, one motion a row."""
    basis[:] = 0.0
    at, row = 0, 0
    for group in range(len(row_starts) - 1):
        first, left = row_starts[group], column_starts[group]
        m, n = row_starts[group + 1] - first, column_starts[group + 1] - left
        factor, x = factors[at : at + m * n].reshape((m, n)), work[:n]
        for r in range(m, n):
            x[:] = 0.0
            x[r] = 1.0
            apply_reflectors(factor, heads[first:], x)
            for k in range(n):
                basis[row, columns[left + k]] = x[k]
            row += 1
        at += m * n


@inner
def add_tasks(
    basis: FloatArray,
    free: FloatArray,
    scale: FloatArray,
    table: IntArray,
    separate: IntArray,
    counts: IntArray,
    figures: FloatArray,
    jacobian: FloatArray,
    order: IntArray,
    work: FloatArray,
    out: FloatArray,
) -> None:
    """Add the secondary tasks' velocities; everything in the scaled variables.

    ``free`` is the projector, in the basis, on what the tasks so far leave.
    """
    d, n = basis.shape
    blocks = 0
    for t in order:
        blocks += counts[t] if separate[t] else min(counts[t], 1)
    free[:] = 0.0
    for r in range(d):
        free[r, r] = 1.0
    added = np.zeros(d)
    for t in order:
        first, count = table[t, 3], counts[t]
        height = 1 if separate[t] else max(count, 1)
        for start in range(first, first + count, height):
            blocks -= 1
            h, rows = figures[start, 2], jacobian[start : start + height]
            if h > 0.0 and height == 1:
                _add_row(basis, free, scale, rows[0], figures[start, 1], h, blocks > 0, work, added)
            elif h > 0.0:
                wanted = figures[start : start + height, 1].copy()
                _add_rows(basis, free, scale, rows, wanted, h, blocks > 0, added)
    for r in range(d):
        for k in range(n):
            out[k] += added[r] * basis[r, k]


@inner
def _add_row(
    basis: FloatArray,
    free: FloatArray,
    scale: FloatArray,
    row: FloatArray,
    wanted: float,
    h: float,
    more: bool,
    work: FloatArray,
    added: FloatArray,
) -> None:
    """`_add_rows` for a task of one row, in closed form."""
    d, n = basis.shape
    own, along, reduced, fixed = work[:n], work[n : n + d], np.empty(d), np.empty(d)
    for k in range(n):
        own[k] = row[k] * scale[k]
    size = dot(own, own) + 1e-30
    velocity = wanted / (size + _TASK_DAMPING**2 * size)
    for r in range(d):
        along[r] = dot(basis[r], own)
    for r in range(d):
        reduced[r] = dot(free[r], along)
        added[r] += h * velocity * reduced[r]
    if not more:
        return
    share = h / (dot(reduced, reduced) + _PROJECTOR_DAMPING**2 * size)
    for r in range(d):
        fixed[r] = dot(free[r], reduced)
    twice = share * share * dot(reduced, fixed)
    for r in range(d):
        for k in range(d):
            change = share * (fixed[r] * reduced[k] + reduced[r] * fixed[k])
            free[r, k] += twice * reduced[r] * reduced[k] - change


@inner
def _add_rows(
    basis: FloatArray,
    free: FloatArray,
    scale: FloatArray,
    rows: FloatArray,
    velocity: FloatArray,
    h: float,
    more: bool,
    added: FloatArray,
) -> None:
    """Add a task's velocity, and take its directions away from the tasks below it if there are more.

    ``velocity`` is what the rows want; it is used up.
    """
    (d, n), m = basis.shape, len(rows)
    own, gram, along = np.empty((m, n)), np.empty((m, m)), np.empty((m, d))
    coordinates, size = np.zeros(d), 0.0
    for i in range(m):
        for k in range(n):
            own[i, k] = rows[i, k] * scale[k]
        for k in range(i + 1):
            gram[i, k] = dot(own[i], own[k])
        size += gram[i, i]
        for r in range(d):
            along[i, r] = dot(own[i], basis[r])
    size = size / m + 1e-30
    for i in range(m):
        gram[i, i] += _TASK_DAMPING**2 * size
    cholesky(gram)
    lower_solve(gram, velocity)
    upper_solve(gram, velocity)
    for i in range(m):
        for r in range(d):
            coordinates[r] += along[i, r] * velocity[i]
    for r in range(d):
        added[r] += h * dot(free[r], coordinates)
    if more:
        reduced = np.empty((m, d))
        for i in range(m):
            for r in range(d):
                reduced[i, r] = dot(free[r], along[i])  # the projector is symmetric
        _remove_directions(free, reduced, _PROJECTOR_DAMPING**2 * size, h)


@inner
def _remove_directions(free: FloatArray, rows: FloatArray, damping: float, h: float) -> None:
    """Replace F by (I - h P) F (I - h P), P the damped projector on the directions of ``rows``.

    With h = 1 and F a projector this is the projector F - P. Damping keeps P continuous where a task
    loses its last direction to those above it.
    """
    m, d = rows.shape
    # A^T (A A^T + damping)^-1 A = (A^T A + damping)^-1 A^T A, whose matrix is the smaller one
    gram, factor = np.zeros((d, d)), np.empty((d, d))
    for i in range(m):
        for r in range(d):
            for k in range(d):
                gram[r, k] += rows[i, r] * rows[i, k]
    for r in range(d):
        for k in range(d):
            factor[r, k] = gram[r, k]
        factor[r, r] += damping
    cholesky(factor)
    kept, x = np.eye(d), np.empty(d)
    for k in range(d):
        for r in range(d):
            x[r] = gram[r, k]
        lower_solve(factor, x)
        upper_solve(factor, x)
        for r in range(d):
            kept[r, k] -= h * x[r]
    half = np.zeros((d, d))
    for r in range(d):
        for k in range(d):
            half[r, k] = dot(kept[r], free[k])  # F is symmetric
    for r in range(d):
        for k in range(d):
            free[r, k] = dot(half[r], kept[k])  # and so is I - h P
