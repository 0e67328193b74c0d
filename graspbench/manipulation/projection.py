"""Prioritised velocities by augmented projection, compiled (thesis 4.10 to 4.13).

Redundancy is resolved in an explicit orthonormal basis Z of the main task's null space, from an LQ
factorisation of the extended Jacobian: what a secondary task adds has no part in the main task, to
rounding, whatever the damping.
"""

import math

import numpy as np
from numba import njit

from graspbench.arrays import FloatArray, IntArray

_TASK_DAMPING = 1e-4
_PROJECTOR_DAMPING = 1e-2


@njit(cache=True, fastmath={"reassoc", "contract"})
def _dot(a: FloatArray, b: FloatArray) -> float:
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@njit(cache=True)
def _cholesky(a: FloatArray) -> None:
    """Factorise a positive definite matrix in place; its lower triangle becomes the factor."""
    for j in range(len(a)):
        pivot = a[j, j] - _dot(a[j, :j], a[j, :j])
        a[j, j] = math.sqrt(max(pivot, 1e-300))
        for i in range(j + 1, len(a)):
            a[i, j] = (a[i, j] - _dot(a[i, :j], a[j, :j])) / a[j, j]


@njit(cache=True)
def _lower_solve(factor: FloatArray, x: FloatArray) -> None:
    for i in range(len(x)):
        x[i] = (x[i] - _dot(factor[i, :i], x[:i])) / factor[i, i]


@njit(cache=True)
def _upper_solve(factor: FloatArray, x: FloatArray) -> None:
    """Solve factor^T y = x in place."""
    for i in range(len(x) - 1, -1, -1):
        x[i] /= factor[i, i]
        for k in range(i):
            x[k] -= factor[i, k] * x[i]


@njit(cache=True)
def _lq(a: FloatArray, heads: FloatArray) -> None:
    """LQ factorisation by Householder reflections of the rows, in place, for m <= n.

    Row i keeps L in its first i + 1 entries and the reflector's tail behind; ``heads`` keeps the heads.
    """
    m, n = a.shape
    for i in range(m):
        length = math.sqrt(_dot(a[i, i:], a[i, i:]))
        if length == 0.0 or i == n - 1:
            heads[i] = 0.0
            continue
        diagonal = -length if a[i, i] > 0.0 else length
        scale = 1.0 / math.sqrt(length * (length + abs(a[i, i])))  # reflector of squared length 2
        heads[i] = (a[i, i] - diagonal) * scale
        for k in range(i + 1, n):
            a[i, k] *= scale
        tail = a[i, i + 1 :]
        for r in range(i + 1, m):
            row = a[r, i + 1 :]
            along = heads[i] * a[r, i] + _dot(tail, row)
            a[r, i] -= along * heads[i]
            for k in range(len(row)):
                row[k] -= along * tail[k]
        a[i, i] = diagonal


@njit(cache=True)
def _apply_reflectors(a: FloatArray, heads: FloatArray, x: FloatArray) -> None:
    """Apply Q^T of the LQ factorisation to a vector of length n, in place."""
    m = len(a)
    for i in range(m - 1, -1, -1):
        tail, rest = a[i, i + 1 :], x[i + 1 :]
        along = heads[i] * x[i] + _dot(tail, rest)
        x[i] -= along * heads[i]
        for k in range(len(rest)):
            rest[k] -= along * tail[k]


@njit(cache=True)
def _smallest_singular_value(a: FloatArray, m: int) -> float:
    """Estimate the smallest singular value of L by inverse iteration; exact 0 if it is singular."""
    x = np.empty(m)
    for i in range(m):
        if abs(a[i, i]) < 1e-12:
            return 0.0
        x[i] = 1.0 + 0.1 * math.cos(3.0 * i)
    value = 0.0
    for _ in range(3):
        _lower_solve(a, x)
        _upper_solve(a, x)
        growth = math.sqrt(_dot(x, x))
        for i in range(m):
            x[i] /= growth
        value = 1.0 / math.sqrt(growth)
    return value


@njit(cache=True)
def prioritised_velocity(
    jacobian: FloatArray,
    wanted: FloatArray,
    scale: FloatArray,
    transpose: bool,
    singular_threshold: float,
    largest_damping: float,
    tasks: FloatArray,
    task_wanted: FloatArray,
    block_starts: IntArray,
    activations: FloatArray,
    n_blocks: int,
    out: FloatArray,
) -> float:
    """Write z' of the augmented projection method into ``out``.

    z' = Jt^+ b + N_o J_a^+ w_a + N_oa J_b^+ w_b + ..., each task projected on the null space of all before
    it. A task of activation h takes the share h of its own velocity, and the share h of its directions
    away from the tasks below it: so z' is continuous when a task enters or leaves smoothly.

    Args:
        jacobian: Extended Jacobian Jt, shape (m, n), m <= n.
        wanted: G^T (v_d + K e), shape (m,).
        scale: 1 / sqrt(weight) of each variable; the pseudo-inverse minimises sum weight z'^2, shape (n,).
        transpose: Use Jt^T instead of the pseudo-inverse for the main task (4.12).
        singular_threshold: Damping begins when the smallest singular value falls below this.
        largest_damping: Damping factor at a singularity.
        tasks: Jacobians of the tasks' blocks, one under the other, shape (rows, n).
        task_wanted: Their K_a e_a, shape (rows,).
        block_starts: First row of each block, and the end, shape (n_blocks + 1,).
        activations: h of each block, 0 to 1, shape (n_blocks,).
        n_blocks: How many blocks there are, in order of priority.
        out: The result z', shape (n,).

    Returns:
        An estimate of the smallest singular value of the scaled extended Jacobian.
    """
    m, n = jacobian.shape
    a = np.empty((m, n))
    for i in range(m):
        for k in range(n):
            a[i, k] = jacobian[i, k] * scale[k]
    if transpose:
        for k in range(n):
            out[k] = 0.0
        for i in range(m):
            for k in range(n):
                out[k] += a[i, k] * wanted[i]
        if n_blocks == 0:
            for k in range(n):
                out[k] *= scale[k]
            return math.nan
    heads = np.empty(m)
    _lq(a, heads)
    smallest: float = _smallest_singular_value(a, m)
    if not transpose:
        for k in range(n):
            out[k] = 0.0
        y = out[:m]
        for i in range(m):
            y[i] = wanted[i]
        if smallest < singular_threshold:
            ratio = smallest / singular_threshold
            damping = largest_damping**2 * (1.0 - ratio * ratio)
            gram = np.empty((m, m))
            for i in range(m):
                for k in range(i + 1):
                    gram[i, k] = _dot(a[i, : k + 1], a[k, : k + 1])
                gram[i, i] += damping
            _cholesky(gram)
            _lower_solve(gram, y)
            _upper_solve(gram, y)
            for i in range(m):  # y <- L^T y, top down: entry i needs the rows from i on
                total = 0.0
                for k in range(i, m):
                    total += a[k, i] * y[k]
                y[i] = total
        else:
            _lower_solve(a, y)
        _apply_reflectors(a, heads, out)
    if n_blocks > 0 and n > m:
        _add_tasks(a, heads, scale, tasks, task_wanted, block_starts, activations, n_blocks, out)
    for k in range(n):
        out[k] *= scale[k]
    return smallest


@njit(cache=True)
def _add_tasks(
    a: FloatArray,
    heads: FloatArray,
    scale: FloatArray,
    tasks: FloatArray,
    task_wanted: FloatArray,
    block_starts: IntArray,
    activations: FloatArray,
    n_blocks: int,
    out: FloatArray,
) -> None:
    """Add the secondary tasks' velocities; everything in the scaled variables."""
    m, n = a.shape
    d = n - m
    basis = np.zeros((d, n))
    for r in range(d):
        basis[r, m + r] = 1.0
        _apply_reflectors(a, heads, basis[r])
    free = np.eye(d)  # projector, in the basis, on what the tasks so far leave
    added, coordinates = np.zeros(d), np.empty(d)
    for block in range(n_blocks):
        first, last = block_starts[block], block_starts[block + 1]
        h, rows = activations[block], last - first
        if h <= 0.0 or rows == 0:
            continue
        own, reduced = np.empty((rows, n)), np.zeros((rows, d))
        size = 0.0
        for i in range(rows):
            for k in range(n):
                own[i, k] = tasks[first + i, k] * scale[k]
            size += _dot(own[i], own[i])
        size = size / rows + 1e-30
        velocity, pull = task_wanted[first:last].copy(), np.zeros(n)
        _damped_solve(own, _TASK_DAMPING**2 * size, velocity)
        for i in range(rows):
            for k in range(n):
                pull[k] += own[i, k] * velocity[i]
        for r in range(d):
            coordinates[r] = _dot(basis[r], pull)
            for i in range(rows):
                along = _dot(own[i], basis[r])
                for k in range(d):
                    reduced[i, k] += along * free[r, k]
        for r in range(d):
            added[r] += h * _dot(free[r], coordinates)
        if block + 1 < n_blocks:
            _remove_directions(free, reduced, _PROJECTOR_DAMPING**2 * size, h)
    for r in range(d):
        for k in range(n):
            out[k] += added[r] * basis[r, k]


@njit(cache=True)
def _damped_solve(rows: FloatArray, damping: float, x: FloatArray) -> None:
    """Solve (A A^T + damping I) y = x in place."""
    m = len(rows)
    gram = np.empty((m, m))
    for i in range(m):
        for k in range(i + 1):
            gram[i, k] = _dot(rows[i], rows[k])
        gram[i, i] += damping
    _cholesky(gram)
    _lower_solve(gram, x)
    _upper_solve(gram, x)


@njit(cache=True)
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
    _cholesky(factor)
    kept, x = np.eye(d), np.empty(d)
    for k in range(d):
        for r in range(d):
            x[r] = gram[r, k]
        _lower_solve(factor, x)
        _upper_solve(factor, x)
        for r in range(d):
            kept[r, k] -= h * x[r]
    half = np.zeros((d, d))
    for r in range(d):
        for k in range(d):
            half[r, k] = _dot(kept[r], free[k])  # F is symmetric
    for r in range(d):
        for k in range(d):
            free[r, k] = _dot(half[r], kept[k])  # and so is I - h P
