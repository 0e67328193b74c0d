"""One control step, compiled: kinematics, pose errors, tasks and the velocity that serves them."""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.manipulation.kernels import evaluate
from graspbench.manipulation.law_arrays import law_arrays, task_arrays
from graspbench.manipulation.projection import (
    damping_factor,
    factorise,
    main_velocity,
    null_basis,
    transposed_velocity,
)
from graspbench.manipulation.rotations import EULER_GUARD, rotation_error
from graspbench.manipulation.state_arrays import state_arrays, system_arrays
from graspbench.manipulation.task_kernels import evaluate_tasks
from graspbench.manipulation.task_projection import add_tasks

FROM_STATE, FROM_TASKS, FROM_VELOCITY = range(3)


@compiled
def control_step(
    system_numbers: FloatArray,
    system_indices: IntArray,
    state_memory: FloatArray,
    law_memory: FloatArray,
    task_numbers: FloatArray,
    task_indices: IntArray,
    order: IntArray,
    position: FloatArray,
    rotation: FloatArray,
    twist: FloatArray,
    time_s: float,
    stage: int,
) -> float:
    """Evaluate the state, pose errors and tasks, and write z' and the contacts' rates.

    Args:
        system_numbers: A block of the system.
        system_indices: Its other block.
        state_memory: Block of the state; its joints and contact variables are given.
        law_memory: Block of the law.
        task_numbers: A block of the tasks.
        task_indices: Their other block.
        order: Tasks, first priority first.
        position: Desired position of the object's origin, shape (3,).
        rotation: Desired orientation, shape (3, 3).
        twist: Desired twist v_d, shape (6,).
        time_s: When, for tasks that enter and leave.
        stage: Where to begin: FROM_STATE; FROM_TASKS where the state and the rows of tasks in Python are up
            to date; FROM_VELOCITY where everything but the order is as in the call before.

    Returns:
        The smallest singular value's estimate, -1 if a ball joint is at its singularity.
    """
    system = system_arrays(system_numbers, system_indices)
    state = state_arrays(state_memory, system_indices)
    law, tasks = law_arrays(law_memory, system_indices), task_arrays(task_numbers, task_indices)
    if stage == FROM_STATE and evaluate(system, state) < EULER_GUARD:
        return -1.0
    if stage <= FROM_TASKS:
        share = 1.0 - law.transpose[0]
        _contact_twists(
            state.object_positions,
            state.object_rotations,
            state.levers,
            system.components,
            law.gain,
            position,
            rotation,
            share * twist,
            law.errors,
            law.wanted,
        )
        evaluate_tasks(system, state, tasks, time_s)
    rows, columns = system.group_rows, system.group_columns
    row_starts, column_starts = system.group_row_starts, system.group_column_starts
    factors, heads, work, velocity = law.factors, law.heads, law.work, law.velocity
    active = np.any(tasks.counts > 0) and len(law.basis) > 0
    transpose, smallest = law.transpose[0] > 0.0, math.nan
    if active or not transpose:
        smallest = factorise(
            rows, row_starts, columns, column_starts, state.jacobian, law.scale, factors, heads, work
        )
    if transpose:
        transposed_velocity(state.jacobian, law.wanted, law.scale, velocity)
    else:
        damping = damping_factor(smallest, law.damping[0], law.damping[1])
        main_velocity(
            rows, row_starts, columns, column_starts, factors, heads, damping, law.wanted, work, velocity
        )
    if active:
        null_basis(row_starts, columns, column_starts, factors, heads, work, law.basis)
        add_tasks(
            law.basis,
            law.free,
            law.scale,
            tasks.table,
            tasks.separate,
            tasks.counts,
            tasks.figures,
            tasks.jacobian,
            order,
            work,
            velocity,
        )
    for k in range(len(velocity)):
        velocity[k] *= law.scale[k]
    _contact_rates(state.xi_jacobians, system.theta_columns, law.velocity, law.contact_rates)
    return smallest


@compiled
def update_state(system_numbers: FloatArray, system_indices: IntArray, state_memory: FloatArray) -> float:
    """Evaluate the state at its joints and contact variables; return the smallest cos theta_2."""
    system = system_arrays(system_numbers, system_indices)
    return evaluate(system, state_arrays(state_memory, system_indices))


@inner
def _contact_twists(
    positions: FloatArray,
    rotations: FloatArray,
    levers: FloatArray,
    components: IntArray,
    gain: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    twist: FloatArray,
    errors: FloatArray,
    out: FloatArray,
) -> None:
    """Write the errors e_i, one loop a finger, and G_i^T (v_d + K e_i) of every contact (4.10).

    The transpose algorithm leaves v_d out (4.12).
    """
    rows = len(components)
    wanted, moved = np.empty(6), np.empty(6)
    for i in range(len(positions)):
        for a in range(3):
            errors[i, a] = position[a] - positions[i, a]
        rotation_error(rotation, rotations[i], errors[i, 3:])
        for a in range(6):
            wanted[a] = gain[a] * errors[i, a] + twist[a]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            moved[a] = wanted[a] + wanted[3 + b] * levers[i, c] - wanted[3 + c] * levers[i, b]
            moved[3 + a] = wanted[3 + a]
        for r in range(rows):
            out[i * rows + r] = moved[components[r]]


@inner
def _contact_rates(
    xi_jacobians: FloatArray, theta_columns: IntArray, velocity: FloatArray, out: FloatArray
) -> None:
    for i in range(len(out)):
        for k in range(2):
            total = 0.0
            for v in range(len(velocity)):
                total += xi_jacobians[i, k, v] * velocity[v]
            out[i, k] = total
        for k in range(3):
            out[i, 2 + k] = velocity[theta_columns[i, k]] if theta_columns[i, k] >= 0 else 0.0
