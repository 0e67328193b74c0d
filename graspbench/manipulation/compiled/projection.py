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
from graspbench.manipulation.compiled.step_records import LawArrays, StateArrays, SystemArrays


@inner
def transposed_velocity(state: StateArrays, law: LawArrays) -> None:
    """Write the transpose algorithm's velocity in the scaled variables (4.12)."""
    jacobian, wanted, scale, out = state.jacobian, law.wanted, law.scale, law.velocity
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
def factorise(system: SystemArrays, state: StateArrays, law: LawArrays) -> float:
    """Factorise the scaled Jacobian group by group; return the smallest singular value's estimate."""
    rows, row_starts = system.group_rows, system.group_row_starts
    columns, column_starts = system.group_columns, system.group_column_starts
    jacobian, scale, factors, heads = state.jacobian, law.scale, law.factors.ravel(), law.heads
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
        smallest = min(smallest, _smallest_singular_value(factor, law.row[:m]))
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
def main_velocity(system: SystemArrays, law: LawArrays, damping: float) -> None:
    """Write the pseudo-inverse's velocity in the scaled variables, damped near a singularity."""
    rows, row_starts = system.group_rows, system.group_row_starts
    columns, column_starts = system.group_columns, system.group_column_starts
    factors, heads, wanted, out = law.factors.ravel(), law.heads, law.wanted, law.velocity
    at = 0
    for group in range(len(row_starts) - 1):
        first, left = row_starts[group], column_starts[group]
        m, n = row_starts[group + 1] - first, column_starts[group + 1] - left
        factor, x = factors[at : at + m * n].reshape((m, n)), law.row[:n]
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
def null_basis(system: SystemArrays, law: LawArrays) -> None:
    """Write an orthonormal basis of the scaled Jacobian's null space, one motion a row."""
    row_starts, columns, column_starts = (
        system.group_row_starts,
        system.group_columns,
        system.group_column_starts,
    )
    factors, heads, basis = law.factors.ravel(), law.heads, law.basis
    basis[:] = 0.0
    at, row = 0, 0
    for group in range(len(row_starts) - 1):
        first, left = row_starts[group], column_starts[group]
        m, n = row_starts[group + 1] - first, column_starts[group + 1] - left
        factor, x = factors[at : at + m * n].reshape((m, n)), law.row[:n]
        for r in range(m, n):
            x[:] = 0.0
            x[r] = 1.0
            apply_reflectors(factor, heads[first:], x)
            for k in range(n):
                basis[row, columns[left + k]] = x[k]
            row += 1
        at += m * n
