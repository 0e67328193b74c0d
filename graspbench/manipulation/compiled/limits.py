"""The hierarchical QP form, compiled: the velocity within hard limits that is closest to the projected one.

By priority: the object's motion, then each task in its order, then the rest come as close to that velocity as
the limits allow, each level in the null space of those above. Everything in the scaled variables x.
"""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.manipulation.compiled.control_step import contact_rates
from graspbench.manipulation.compiled.dense import dot
from graspbench.manipulation.compiled.least_distance import least_distance
from graspbench.manipulation.compiled.level import null_directions, solve_level
from graspbench.manipulation.compiled.limit_arrays import FAR, SLACK, LimitArrays, is_admissible
from graspbench.manipulation.compiled.record_type import opener
from graspbench.manipulation.compiled.step_records import LawArrays, StateArrays, SystemArrays, TaskTable
from graspbench.manipulation.compiled.task_kernel import task_at

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
    levels = 0 if is_admissible(limits) else _solve_levels(state, law, table, limits, order)
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
    if missed > SLACK or not solve_level(none, near[:0], basis, limits):
        limits.x[:] = near
        whole = np.eye(len(near))
        if not solve_level(main, law.wanted, whole, limits):
            _relax_distances(limits)
            limits.x[:] = near
            if not solve_level(main, law.wanted, whole, limits):
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
            if not solve_level(matrix, wanted, free, limits):
                return levels
            free = null_directions(matrix, free)
            levels += 1
    if len(free) > 0 and solve_level(none, near[:0], free, limits):
        levels += 1
    return levels


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
