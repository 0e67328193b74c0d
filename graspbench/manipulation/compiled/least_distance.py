"""The point of a polyhedron that is nearest to the origin, compiled (Lawson and Hanson 1974, chapter 23).

Least squares under inequalities come down to it by a change of variables. Its dual is a least-squares problem
in non-negative multipliers, solved by their active set: a few steps for the few limits that bind.
"""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.manipulation.compiled.dense import cholesky, dot, lower_solve, upper_solve

_TOLERANCE = 1e-11
"""Of a row's violation, as a share of the largest one at the origin."""
_MIN_SHARE = 1e-10
"""The dual's residual below which there is no such point."""


@inner
def least_distance(rows: FloatArray, least: FloatArray, out: FloatArray) -> bool:
    """Write the smallest w with ``rows`` w >= ``least``; return whether there is one.

    Args:
        rows: Unit rows, shape (m, d).
        least: Shape (m,).
        out: The result, shape (d,).
    """
    m, d = rows.shape
    out[:] = 0.0
    largest = 0.0
    for j in range(m):
        largest = max(largest, least[j])
    if largest <= 0.0:
        return True
    goal = least / largest
    multipliers, trial, members = np.zeros(m), np.zeros(m), np.zeros(m, dtype=np.int64)
    gram = np.empty((m, m))
    open_rows = np.ones(m, dtype=np.int64)
    count, residual = 0, 1.0
    for _ in range(3 * m + 10):
        entering, worst = -1, _TOLERANCE
        for j in range(m):
            if open_rows[j] == 1:
                violation = goal[j] - dot(rows[j], out)
                if violation > worst:
                    entering, worst = j, violation
        if entering < 0:
            break
        members[count] = entering
        multipliers[entering] = 0.0
        open_rows[entering] = 0
        count += 1
        if not _solve_members(rows, goal, members, count, gram, trial):
            count -= 1
            open_rows[entering] = 2  # depends on the members: it holds or fails with them
            continue
        count = _keep_positive(rows, goal, members, count, gram, trial, multipliers, open_rows)
        residual = 1.0
        out[:] = 0.0
        for k in range(count):
            j = members[k]
            residual -= goal[j] * multipliers[j]
            for a in range(d):
                out[a] += multipliers[j] * rows[j, a]
        if residual < _MIN_SHARE:
            return False
        for a in range(d):
            out[a] /= residual
        for j in range(m):
            if open_rows[j] == 2:
                open_rows[j] = 1
    for a in range(d):
        out[a] *= largest
    return True


@inner
def _solve_members(
    rows: FloatArray, goal: FloatArray, members: IntArray, count: int, gram: FloatArray, trial: FloatArray
) -> bool:
    """Write the members' multipliers whatever their signs; return whether the rows are independent."""
    factor = gram[:count, :count]
    for i in range(count):
        for k in range(i + 1):
            one, other = members[i], members[k]
            factor[i, k] = dot(rows[one], rows[other]) + goal[one] * goal[other]
        trial[i] = goal[members[i]]
    cholesky(factor)
    for i in range(count):
        if factor[i, i] < 1e-7:
            return False
    lower_solve(factor, trial[:count])
    upper_solve(factor, trial[:count])
    return True


@inner
def _keep_positive(
    rows: FloatArray,
    goal: FloatArray,
    members: IntArray,
    count: int,
    gram: FloatArray,
    trial: FloatArray,
    multipliers: FloatArray,
    open_rows: IntArray,
) -> int:
    """Move the multipliers to the trial's, letting go of those that turn negative; return who is left."""
    while count > 0:
        share, blocking = 1.0, -1
        for k in range(count):
            old = multipliers[members[k]]
            if trial[k] <= 0.0:
                reach = old / (old - trial[k]) if old > trial[k] else 0.0
                if reach < share:
                    share, blocking = reach, k
        left = 0
        for k in range(count):
            j = members[k]
            multipliers[j] += share * (trial[k] - multipliers[j])
            if k == blocking or multipliers[j] <= 0.0:
                multipliers[j] = 0.0
                open_rows[j] = 1
            else:
                members[left] = j
                left += 1
        if blocking < 0:
            return left
        count = left
        if not _solve_members(rows, goal, members, count, gram, trial):
            return count
    return count
