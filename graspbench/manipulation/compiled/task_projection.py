"""What secondary tasks add to the main task's velocity, compiled (thesis 4.13)."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.manipulation.compiled.dense import cholesky, dot, lower_solve, upper_solve
from graspbench.manipulation.compiled.step_records import LawArrays, TaskTable
from graspbench.manipulation.compiled.task_kernel import task_at

_TASK_DAMPING = 1e-4
_PROJECTOR_DAMPING = 1e-2


@inner
def add_tasks(law: LawArrays, table: TaskTable, order: IntArray) -> None:
    """Add the secondary tasks' velocities; everything in the scaled variables.

    ``law.projector`` is the projector, in the basis, on what the tasks so far leave.
    """
    basis, projector, out, counts = law.basis, law.projector, law.velocity, table.counts
    d, n = basis.shape
    blocks = 0
    for t in order:
        blocks += counts[t] if table.separate[t] else min(counts[t], 1)
    projector[:] = 0.0
    for r in range(d):
        projector[r, r] = 1.0
    added = np.zeros(d)
    for t in order:
        task, count = task_at(table.blocks[t]), counts[t]
        height = 1 if table.separate[t] else max(count, 1)
        for first in range(0, count, height):
            blocks -= 1
            h, rows = task.activations[first], task.jacobian[first : first + height]
            if h > 0.0 and height == 1:
                _add_row(law, rows[0], task.errors[first], h, blocks > 0, added)
            elif h > 0.0:
                _add_rows(law, rows, task.errors[first : first + height].copy(), h, blocks > 0, added)
    for r in range(d):
        for k in range(n):
            out[k] += added[r] * basis[r, k]


@inner
def _add_row(law: LawArrays, row: FloatArray, wanted: float, h: float, more: bool, added: FloatArray) -> None:
    """`_add_rows` for a task of one row, in closed form."""
    basis, free, scale, own, along = law.basis, law.projector, law.scale, law.row, law.row_along_basis
    d, n = basis.shape
    reduced, fixed = np.empty(d), np.empty(d)
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
    law: LawArrays, rows: FloatArray, velocity: FloatArray, h: float, more: bool, added: FloatArray
) -> None:
    """Add a task's velocity, and take its directions away from the tasks below it if there are more.

    ``velocity`` is what the rows want; it is used up.
    """
    basis, free, scale = law.basis, law.projector, law.scale
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
