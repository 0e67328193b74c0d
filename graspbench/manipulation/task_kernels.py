"""The built-in secondary tasks, compiled: a control step evaluates them without leaving compiled code.

Each writes value, error and activation of its rows into ``figures``, their derivatives into ``jacobian``,
and returns how many there are. ``own`` and ``numbers`` are the task's, as its class in `tasks` packs them.
"""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.manipulation.law_arrays import TaskArrays, task_arrays
from graspbench.manipulation.memory import shared
from graspbench.manipulation.state_arrays import StateArrays, SystemArrays, state_arrays, system_arrays

IN_PYTHON = -1
JOINT_LIMIT, FINGERTIP_DISTANCE, JOINT_CENTRING, CONTACTS_NEAR_POINT, EDGE_DISTANCE, MANIPULABILITY = range(6)
COMMON = 4
"""Numbers every task has before its own: gain, start, end, ramp."""


@inner
def evaluate_tasks(system: SystemArrays, state: StateArrays, tasks: TaskArrays, time_s: float) -> None:
    """Write every task's rows at a state and time; those of tasks in Python must be there already."""
    for t in range(len(tasks.counts)):
        if tasks.table[t, 0] != IN_PYTHON:
            _evaluate(t, system, state, tasks)
        common = tasks.numbers[tasks.table[t, 2] : tasks.table[t, 2] + COMMON]
        first = tasks.table[t, 3]
        tasks.activations[t] = _weigh(common, time_s, tasks.figures[first : first + tasks.counts[t]])
        if tasks.activations[t] == 0.0:
            tasks.counts[t] = 0


@inner
def _weigh(common: FloatArray, time_s: float, figures: FloatArray) -> float:
    """Multiply a task's errors by its gain, its activations by its presence; return the largest of these."""
    presence = smooth_step((time_s - common[1]) / common[3])
    if time_s > common[2]:
        presence *= 1.0 - smooth_step((time_s - common[2]) / common[3])
    largest = 0.0
    for r in range(len(figures)):
        figures[r, 1] *= common[0]
        figures[r, 2] *= presence
        largest = max(largest, figures[r, 2])
    return largest


@compiled
def evaluate_task(
    system_numbers: FloatArray,
    system_indices: IntArray,
    state_memory: FloatArray,
    task_numbers: FloatArray,
    task_indices: IntArray,
) -> None:
    """Write the first task's rows: its error itself, and its activation whatever the time."""
    system, state = system_arrays(system_numbers, system_indices), state_arrays(state_memory, system_indices)
    _evaluate(0, system, state, task_arrays(task_numbers, task_indices))


@inner
def _evaluate(t: int, system: SystemArrays, state: StateArrays, tasks: TaskArrays) -> None:
    kind, first = tasks.table[t, 0], tasks.table[t, 3]
    own, numbers = tasks.indices[tasks.table[t, 1] :], tasks.numbers[tasks.table[t, 2] + COMMON :]
    figures, jacobian, count = tasks.figures[first:], tasks.jacobian[first:], 0
    if kind == JOINT_LIMIT:
        count = _joint_limit(state.joints, own, numbers, figures, jacobian)
    elif kind == FINGERTIP_DISTANCE:
        count = _fingertip_distance(state.tip_positions, state.tip_jacobians, own, numbers, figures, jacobian)
    elif kind == JOINT_CENTRING:
        count = _joint_centring(state.joints, numbers, figures, jacobian)
    elif kind == CONTACTS_NEAR_POINT:
        count = _contacts_near_point(
            state.surface_points, state.surface_tangents, state.xi_jacobians, own, numbers, figures, jacobian
        )
    elif kind == EDGE_DISTANCE:
        count = _edge_distance(state.contact_variables, state.xi_jacobians, own, numbers, figures, jacobian)
    elif kind == MANIPULABILITY:
        spatial, path = len(system.components) == 6, system.paths[own[0]]
        tip = state.tip_jacobians[own[0]]
        count = _manipulability(tip, state.joint_axes, path, spatial, numbers, figures, jacobian)
    tasks.counts[t] = count


@shared
def smooth_step(x: float) -> float:
    """Return 0 below 0, 1 above 1, and the fifth-order polynomial with flat ends in between."""
    x = min(max(x, 0.0), 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@inner
def _open_row(
    figures: FloatArray, jacobian: FloatArray, row: int, value: float, error: float, activation: float
) -> None:
    """Write a row's figures and clear its Jacobian."""
    figures[row, 0], figures[row, 1], figures[row, 2] = value, error, activation
    for v in range(jacobian.shape[1]):
        jacobian[row, v] = 0.0


@inner
def _beyond(x: float, lower: float, upper: float, margin: float) -> tuple[float, float]:
    """Return how deep x is inside a margin (none if not positive), and the way back out."""
    above, below = x - (upper - margin), (lower + margin) - x
    return (above, -above) if above > below else (below, below)


@inner
def _joint_limit(
    joints: FloatArray, own: IntArray, numbers: FloatArray, figures: FloatArray, jacobian: FloatArray
) -> int:
    """``own``: count, joints; ``numbers``: margin, then lower and upper limit of each joint."""
    count, margin = 0, numbers[0]
    for k in range(own[0]):
        joint = own[1 + k]
        depth, back = _beyond(joints[joint], numbers[1 + 2 * k], numbers[2 + 2 * k], margin)
        if depth > 0.0:
            # full strength half-way into the margin, so that the limit itself is never needed
            _open_row(figures, jacobian, count, joints[joint], back, smooth_step(2.0 * depth / margin))
            jacobian[count, joint] = 1.0
            count += 1
    return count


@inner
def _fingertip_distance(
    tips: FloatArray,
    tip_jacobians: FloatArray,
    own: IntArray,
    numbers: FloatArray,
    figures: FloatArray,
    jacobian: FloatArray,
) -> int:
    """``own``: both fingers; ``numbers``: minimum, threshold."""
    one, other, minimum, threshold = own[0], own[1], numbers[0], numbers[1]
    square = 0.0
    for a in range(3):
        square += (tips[other, a] - tips[one, a]) ** 2
    distance = math.sqrt(square)
    if distance >= threshold:
        return 0
    activation = smooth_step((threshold - distance) / (threshold - minimum))
    _open_row(figures, jacobian, 0, distance, threshold - distance, activation)
    for a in range(3):
        share = (tips[other, a] - tips[one, a]) / max(distance, 1e-9)
        for q in range(tip_jacobians.shape[2]):
            jacobian[0, q] += share * (tip_jacobians[other, a, q] - tip_jacobians[one, a, q])
    return 1


@inner
def _joint_centring(
    joints: FloatArray, numbers: FloatArray, figures: FloatArray, jacobian: FloatArray
) -> int:
    """``numbers``: the posture."""
    for q in range(len(joints)):
        _open_row(figures, jacobian, q, joints[q], numbers[q] - joints[q], 1.0)
        jacobian[q, q] = 1.0
    return len(joints)


@inner
def _contacts_near_point(
    points: FloatArray,
    tangents: FloatArray,
    xi_jacobians: FloatArray,
    own: IntArray,
    numbers: FloatArray,
    figures: FloatArray,
    jacobian: FloatArray,
) -> int:
    """``own``: count, contacts, count, others; ``numbers``: point, reach."""
    n_others = own[1 + own[0]]
    for n in range(own[0]):
        i, square = own[1 + n], 0.0
        for a in range(3):
            row, target = 3 * n + a, 0.0 if n_others > 0 else numbers[a]
            for k in range(n_others):
                target += points[own[2 + own[0] + k], a] / n_others
            offset = points[i, a] - target
            square += offset * offset
            _open_row(figures, jacobian, row, offset, -offset, 1.0)
            _add_point_rates(tangents, xi_jacobians, i, a, 1.0, row, jacobian)
            for k in range(n_others):
                other = own[2 + own[0] + k]
                _add_point_rates(tangents, xi_jacobians, other, a, -1.0 / n_others, row, jacobian)
        for a in range(3):
            figures[3 * n + a, 1] /= math.sqrt(1.0 + square / (numbers[3] * numbers[3]))
    return int(3 * own[0])


@inner
def _add_point_rates(
    tangents: FloatArray,
    xi_jacobians: FloatArray,
    contact: int,
    axis: int,
    share: float,
    row: int,
    jacobian: FloatArray,
) -> None:
    for k in range(2):
        tangent = share * tangents[contact, axis, k]
        for v in range(jacobian.shape[1]):
            jacobian[row, v] += tangent * xi_jacobians[contact, k, v]


@inner
def _edge_distance(
    variables: FloatArray,
    xi_jacobians: FloatArray,
    own: IntArray,
    numbers: FloatArray,
    figures: FloatArray,
    jacobian: FloatArray,
) -> int:
    """``own``: count, contacts; ``numbers``: margin as a share, then u and v range of each contact."""
    count = 0
    for c in range(own[0]):
        i = own[1 + c]
        for k in range(2):
            low, high = numbers[1 + 4 * c + 2 * k], numbers[2 + 4 * c + 2 * k]
            margin, moves = numbers[0] * (high - low), False
            depth, back = _beyond(variables[i, k], low, high, margin)
            for v in range(jacobian.shape[1]):
                moves |= xi_jacobians[i, k, v] != 0.0
            if depth > 0.0 and moves:
                _open_row(figures, jacobian, count, variables[i, k], back, smooth_step(2.0 * depth / margin))
                for v in range(jacobian.shape[1]):
                    jacobian[count, v] = xi_jacobians[i, k, v]
                count += 1
    return count


@inner
def _manipulability(
    tip: FloatArray,
    axes: FloatArray,
    path: IntArray,
    spatial: bool,
    numbers: FloatArray,
    figures: FloatArray,
    jacobian: FloatArray,
) -> int:
    """``tip``: the finger's Jacobian; ``numbers``: threshold.

    d sqrt(det(J J^T)) = value tr((J J^T)^-1 J dJ^T); column j of J turns as axis_min(j, k) x column_max(j, k)
    with joint k.
    """
    n_q, n_rows = len(path), 3 if spatial else 2
    gram, inverse = np.eye(3), np.empty((3, 3))
    for a in range(n_rows):
        for b in range(n_rows):
            gram[a, b] = 0.0
            for q in range(n_q):
                gram[a, b] += tip[a, q] * tip[b, q]
    value, threshold = math.sqrt(max(_inverse3(gram, inverse), 0.0)), numbers[0]
    if value >= threshold or value == 0.0:  # at a singularity the gradient does not exist
        return 0
    activation = smooth_step(2.0 * (1.0 - value / threshold))
    _open_row(figures, jacobian, 0, value, threshold - value, activation)
    for j in range(n_q):
        for a in range(n_rows):
            dual = 0.0
            for b in range(n_rows):
                dual += value * inverse[a, b] * tip[b, j]
            b, c = (a + 1) % 3, (a + 2) % 3
            for k in range(n_q):
                if path[j] and path[k]:
                    low, high = min(j, k), max(j, k)
                    jacobian[0, k] += dual * (axes[low, b] * tip[c, high] - axes[low, c] * tip[b, high])
    return 1


@inner
def _inverse3(matrix: FloatArray, inverse: FloatArray) -> float:
    """Write the inverse of a symmetric (3, 3) matrix by cofactors; return the determinant."""
    for a in range(3):
        for b in range(3):
            p, q, r, s = (a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3
            inverse[a, b] = matrix[p, r] * matrix[q, s] - matrix[p, s] * matrix[q, r]
    determinant = 0.0
    for b in range(3):
        determinant += matrix[0, b] * inverse[0, b]
    for a in range(3):
        for b in range(3):
            inverse[a, b] /= determinant if determinant != 0.0 else 1.0
    return determinant
