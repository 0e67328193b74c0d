"""The hierarchical QP form, compiled: the velocity within hard limits that is closest to the projected one.

By priority: the object's motion, then each task in its order, then the rest come as close to that velocity as
the limits allow, each level in the null space of those above. Everything in the scaled variables x.
"""

import math
from typing import Annotated

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.manipulation.compiled.control_step import contact_rates
from graspbench.manipulation.compiled.dense import (
    apply_reflectors,
    cholesky,
    dot,
    lower_solve,
    lq,
    upper_solve,
)
from graspbench.manipulation.compiled.least_distance import least_distance
from graspbench.manipulation.compiled.record import Record
from graspbench.manipulation.compiled.record_type import opener
from graspbench.manipulation.compiled.step_records import LawArrays, StateArrays, SystemArrays, TaskTable
from graspbench.manipulation.compiled.task_kernel import task_at

FAR = 1e8
"""A bound that is none."""
_SLACK = 1e-9
_TIE = 1e-7
_RANK = 1e-8


class LimitArrays(Record):
    """The limits, and room to work.

    Attributes:
        gain: Share of the way to a limit that may be gone in a second, 1/s.
        margin_m: Added to the least distances.
        lower: Lower joint limits, rad.
        upper: Upper joint limits, rad.
        fastest: Joint velocity limits, rad/s.
        domains: Where the contacts' charts may be used.
        pairs: Fingers to keep apart.
        distances_m: Their least distances.
        low: Lower bounds of x now.
        high: Upper bounds of x now.
        rows: Derivatives of the pairs' distances with respect to x.
        least: Lower bounds of their rates now.
        near: The projected velocity.
        x: The result.
    """

    gain: float
    margin_m: float
    lower: Annotated[FloatArray, "joints"]
    upper: Annotated[FloatArray, "joints"]
    fastest: Annotated[FloatArray, "joints"]
    domains: Annotated[FloatArray, "contacts", 2, 2]
    pairs: Annotated[IntArray, "pairs", 2]
    distances_m: Annotated[FloatArray, "pairs"]
    low: Annotated[FloatArray, "variables"]
    high: Annotated[FloatArray, "variables"]
    rows: Annotated[FloatArray, "pairs", "variables"]
    least: Annotated[FloatArray, "pairs"]
    near: Annotated[FloatArray, "variables"]
    x: Annotated[FloatArray, "variables"]


_open_system, _open_state, _open_law = opener(SystemArrays), opener(StateArrays), opener(LawArrays)
_open_table, _open_limits = opener(TaskTable), opener(LimitArrays)


@compiled
def limit_velocity(
    system_block: FloatArray,
    state_block: FloatArray,
    law_block: FloatArray,
    table_block: FloatArray,
    limits_block: FloatArray,
    order: IntArray,
) -> int:
    """Replace z' by the admissible velocity that comes closest to it, by priority.

    Returns:
        How many levels were solved: 0 where z' meets all limits, -1 where nothing does.
    """
    system, state = _open_system(system_block), _open_state(state_block)
    law, table, limits = _open_law(law_block), _open_table(table_block), _open_limits(limits_block)
    _write_bounds(system, state, law, limits)
    near, x, scale = limits.near, limits.x, law.scale
    for v in range(len(near)):
        near[v] = law.velocity[v] / scale[v]
        x[v] = near[v]
    levels = 0 if _is_admissible(limits) else _solve_levels(state, law, table, limits, order)
    if levels < 0:
        return levels
    for v in range(len(near)):
        law.velocity[v] = min(max(x[v], limits.low[v]), limits.high[v]) * scale[v]
    contact_rates(system, state, law)
    return levels


@inner
def _write_bounds(system: SystemArrays, state: StateArrays, law: LawArrays, limits: LimitArrays) -> None:
    """Write the bounds of x and of the distances' rates.

    A joint beyond its limit has to come back, as fast as the limit's gain says but never faster than its
    velocity limit: so the box is never empty.
    """
    low, high, scale, gain, joints = limits.low, limits.high, law.scale, limits.gain, state.joints
    low[:], high[:] = -FAR, FAR
    for q in range(len(joints)):
        fastest = limits.fastest[q]
        low[q] = max(min(max(gain * (limits.lower[q] - joints[q]), -fastest), fastest), -FAR)
        high[q] = min(min(max(gain * (limits.upper[q] - joints[q]), -fastest), fastest), FAR)
    for i in range(len(limits.domains)):
        for k in range(2):
            column = system.xi_columns[i, k]
            if column >= 0:
                at = state.contact_variables[i, k]
                low[column] = max(gain * (limits.domains[i, k, 0] - at), -FAR)
                high[column] = min(gain * (limits.domains[i, k, 1] - at), FAR)
    for v in range(len(low)):
        low[v] /= scale[v]
        high[v] /= scale[v]
    limits.rows[:] = 0.0
    for p in range(len(limits.pairs)):
        one, other = limits.pairs[p, 0], limits.pairs[p, 1]
        between = state.tip_positions[other] - state.tip_positions[one]
        distance = math.sqrt(dot(between, between))
        for q in range(len(joints)):
            for a in range(3):
                relative = state.tip_jacobians[other, a, q] - state.tip_jacobians[one, a, q]
                limits.rows[p, q] += between[a] / max(distance, 1e-9) * relative * scale[q]
        limits.least[p] = -gain * (distance - limits.distances_m[p] - limits.margin_m)


@inner
def _is_admissible(limits: LimitArrays) -> bool:
    x = limits.x
    for v in range(len(x)):
        if x[v] < limits.low[v] - _SLACK or x[v] > limits.high[v] + _SLACK:
            return False
    closest = 0.0
    for p in range(len(limits.least)):
        closest = min(closest, dot(limits.rows[p], x) - limits.least[p])
    return closest >= -_SLACK


@inner
def _solve_levels(
    state: StateArrays, law: LawArrays, table: TaskTable, limits: LimitArrays, order: IntArray
) -> int:
    """Write x level by level; return how many were solved, -1 if the first cannot be."""
    scale, near, basis, none = law.scale, limits.near, law.basis, np.empty((0, len(limits.x)))
    main = state.jacobian * scale
    missed = 0.0
    for i in range(len(main)):
        missed = max(missed, abs(dot(main[i], near) - law.wanted[i]))
    # where the projected velocity moves the object as wanted, its null space may be all that is needed
    if missed > _SLACK or not _solve_level(none, near[:0], basis, limits):
        limits.x[:] = near
        whole = np.eye(len(near))
        if not _solve_level(main, law.wanted, whole, limits):
            _relax_distances(limits)
            limits.x[:] = near
            if not _solve_level(main, law.wanted, whole, limits):
                return -1
    levels, free = 1, basis
    for t in order:
        if len(free) == 0:
            return levels
        if table.counts[t] > 0:
            task = task_at(table.blocks[t])
            matrix = task.jacobian[: table.counts[t]] * scale
            wanted = np.empty(len(matrix))
            for r in range(len(matrix)):
                wanted[r] = dot(matrix[r], near)
            if not _solve_level(matrix, wanted, free, limits):
                return levels
            free = _null_directions(matrix, free)
            levels += 1
    if len(free) > 0 and _solve_level(none, near[:0], free, limits):
        levels += 1
    return levels


@inner
def _solve_level(matrix: FloatArray, wanted: FloatArray, free: FloatArray, limits: LimitArrays) -> bool:
    """Move x along the rows of ``free`` to the least |matrix x - wanted|^2 inside the limits.

    Ties go to the velocity that is nearest to the projected one; the second pass is a step of the proximal
    point method, which takes the tie's bias out of weak directions. Without a matrix the tie is all.

    Returns:
        Whether there is such a point; if not, x stays.
    """
    d, x = len(free), limits.x
    if d == 0:
        return _is_admissible(limits)
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
def _relax_distances(limits: LimitArrays) -> None:
    """Lower the distances' bounds by the least squares of relaxing that the box asks for."""
    k, n = limits.rows.shape
    light = 1e-3  # of x against the relaxation
    sides, least = np.zeros((2 * n + 2 * k, n + k)), np.empty(2 * n + 2 * k)
    count = 0
    for v in range(n):
        if limits.low[v] > -0.5 * FAR:
            sides[count, v], least[count] = 1.0, light * limits.low[v]
            count += 1
        if limits.high[v] < 0.5 * FAR:
            sides[count, v], least[count] = -1.0, -light * limits.high[v]
            count += 1
    for p in range(k):
        length = math.sqrt(dot(limits.rows[p], limits.rows[p]) / light**2 + 1.0)
        for v in range(n):
            sides[count, v] = limits.rows[p, v] / light / length
        sides[count, n + p], least[count] = 1.0 / length, limits.least[p] / length
        sides[count + 1, n + p], least[count + 1] = 1.0, 0.0
        count += 2
    found = np.empty(n + k)
    if least_distance(sides[:count], least[:count], found):
        for p in range(k):
            limits.least[p] -= max(found[n + p], 0.0) + 1e-7
    else:  # as a last resort the distances give way altogether: the box always has a solution
        limits.least[:] = -FAR


@inner
def _null_directions(matrix: FloatArray, free: FloatArray) -> FloatArray:
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
