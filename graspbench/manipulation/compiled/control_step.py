"""One control step, compiled: kinematics, pose errors, tasks and the velocity that serves them."""

import math
from enum import IntEnum

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.manipulation.compiled.extended_fingers import evaluate, riding
from graspbench.manipulation.compiled.projection import (
    damping_factor,
    factorise,
    main_velocity,
    null_basis,
    transposed_velocity,
)
from graspbench.manipulation.compiled.record_type import opener
from graspbench.manipulation.compiled.rotations import EULER_GUARD, rotation_error
from graspbench.manipulation.compiled.step_records import LawArrays, StateArrays, SystemArrays, TaskTable
from graspbench.manipulation.compiled.task_kernel import call_kernel, task_at
from graspbench.manipulation.compiled.task_projection import add_tasks
from graspbench.manipulation.compiled.task_rows import weigh
from graspbench.manipulation.pose_sample import PoseSample

_open_system, _open_state = opener(SystemArrays), opener(StateArrays)
_open_law, _open_table = opener(LawArrays), opener(TaskTable)


class Stage(IntEnum):
    """Where a control step begins."""

    STATE = 0
    """At the kinematics."""
    TASKS = 1
    """The state and the rows of tasks in Python are up to date."""
    VELOCITY = 2
    """Everything but the tasks' order is as in the step before."""


@compiled
def control_step(
    system_block: FloatArray,
    state_block: FloatArray,
    law_block: FloatArray,
    table_block: FloatArray,
    order: IntArray,
    desired: PoseSample,
    time_s: float,
    stage: int,
) -> float:
    """Evaluate the state, pose errors and tasks, and write z' and the contacts' rates.

    Args:
        system_block: Of `SystemArrays`.
        state_block: Of `StateArrays`; its joints and contact variables are given.
        law_block: Of `LawArrays`.
        table_block: Of `TaskTable`.
        order: Tasks, first priority first.
        desired: Where the object shall be.
        time_s: When, for tasks that enter and leave.
        stage: Where to begin, a `Stage`.

    Returns:
        The smallest singular value's estimate, -1 if a ball joint is at its singularity.
    """
    system, state = _open_system(system_block), _open_state(state_block)
    law, table = _open_law(law_block), _open_table(table_block)
    if stage == Stage.STATE and evaluate(system, state) < EULER_GUARD:
        return -1.0
    if stage <= Stage.TASKS:
        _contact_twists(system, state, law, desired)
        _evaluate_tasks(system, state, table, time_s)
    active = np.any(table.counts > 0) and len(law.basis) > 0
    smallest = math.nan
    if active or law.transpose == 0:
        smallest = factorise(system, state, law)
    if law.transpose == 1:
        transposed_velocity(state, law)
    else:
        main_velocity(system, law, damping_factor(smallest, law.singular_threshold, law.largest_damping))
    if active or law.limited == 1:
        null_basis(system, law)
    if active:
        add_tasks(law, table, order)
    velocity, scale = law.velocity, law.scale
    for k in range(len(velocity)):
        velocity[k] *= scale[k]
    contact_rates(system, state, law)
    return smallest


@compiled
def update_state(system_block: FloatArray, state_block: FloatArray) -> float:
    """Evaluate the state at its joints and contact variables; return the smallest cos theta_2."""
    return evaluate(_open_system(system_block), _open_state(state_block))


@compiled
def evaluate_task(
    system_block: FloatArray, state_block: FloatArray, table_block: FloatArray, task: int
) -> None:
    """Write a compiled task's rows: its errors themselves, and its activations whatever the time."""
    table = _open_table(table_block)
    _evaluate_task(_open_system(system_block), _open_state(state_block), table, task)


@inner
def _evaluate_tasks(system: SystemArrays, state: StateArrays, table: TaskTable, time_s: float) -> None:
    """Write every task's rows at a state and time; those of tasks in Python must be there already."""
    for t in range(len(table.counts)):
        _evaluate_task(system, state, table, t)
        table.activations[t] = weigh(task_at(table.blocks[t]), table.counts[t], time_s)
        if table.activations[t] == 0.0:
            table.counts[t] = 0


@inner
def _evaluate_task(system: SystemArrays, state: StateArrays, table: TaskTable, task: int) -> None:
    kernel = table.kernels[task]
    if kernel != 0:
        table.counts[task] = call_kernel(kernel, system, state, task_at(table.blocks[task]))


@inner
def _contact_twists(system: SystemArrays, state: StateArrays, law: LawArrays, desired: PoseSample) -> None:
    """Write the errors e_i, one loop a finger, and G_i^T (v_d + K e_i) of every contact (4.10).

    The transpose algorithm leaves v_d out (4.12).
    """
    positions, rotations, levers = state.object_positions, state.object_rotations, state.levers
    components, gain, errors, out = system.twist_components, law.gain, law.errors, law.wanted
    rows, share = len(components), 1.0 - law.transpose
    wanted, moved = np.empty(6), np.empty(6)
    for i in range(len(positions)):
        for a in range(3):
            errors[i, a] = desired.position[a] - positions[i, a]
        rotation_error(desired.rotation, rotations[i], errors[i, 3:])
        for a in range(6):
            wanted[a] = gain[a] * errors[i, a] + share * desired.twist[a]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            moved[a] = wanted[a] + wanted[3 + b] * levers[i, c] - wanted[3 + c] * levers[i, b]
            moved[3 + a] = wanted[3 + a]
        for k in range(2):
            led = share * law.led_rates[i, k]
            if led != 0.0:
                _add_led(system, state, i, k, led, moved)
        for r in range(rows):
            out[i * rows + r] = moved[components[r]]


@inner
def _add_led(
    system: SystemArrays, state: StateArrays, i: int, k: int, rate: float, moved: FloatArray
) -> None:
    """Add how finger and ball joint move for a contact coordinate that is led at a rate."""
    along, rotation, spin = riding(system, state, i, k), state.object_rotations[i], state.surface_spins[i]
    for a in range(3):
        for b in range(3):
            moved[a] += rotation[a, b] * along[b] * rate
            moved[3 + a] += rotation[a, b] * spin[b, k] * rate


@inner
def contact_rates(system: SystemArrays, state: StateArrays, law: LawArrays) -> None:
    """Write the rates of all contact variables that go with z'."""
    xi_jacobians, theta_columns = state.xi_jacobians, system.theta_columns
    velocity, out = law.velocity, law.contact_rates
    for i in range(len(out)):
        for k in range(2):
            total = law.led_rates[i, k]
            for v in range(len(velocity)):
                total += xi_jacobians[i, k, v] * velocity[v]
            out[i, k] = total
        for k in range(3):
            out[i, 2 + k] = velocity[theta_columns[i, k]] if theta_columns[i, k] >= 0 else 0.0
