"""Compiled kinematics of a hand, its contacts and the object (thesis 4.1 and 4.2).

One call of `evaluate` fills a `StateArrays` from joint and contact variables.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.chart_kernels import chart_derivatives, gauss_frame
from graspbench.manipulation.rotations import (
    axis_angle_matrix,
    euler_matrix,
    euler_rates,
    matmul3,
    rotation_error,
)


class SystemArrays(NamedTuple):
    """What does not change while the object moves; see `system.ManipulationSystem`."""

    parents: IntArray  # (n_q,)
    placement_rotations: FloatArray  # (n_q, 3, 3)
    placement_translations: FloatArray  # (n_q, 3)
    axes: FloatArray  # (n_q, 3)
    tip_joints: IntArray  # (n_c,)
    tip_rotations: FloatArray  # (n_c, 3, 3)
    tip_translations: FloatArray  # (n_c, 3)
    paths: IntArray  # (n_c, n_q)
    chart_kinds: IntArray  # (n_c,)
    chart_parameters: FloatArray  # (n_c, p)
    tip_radii: FloatArray  # (n_c,)
    rolling: IntArray  # (n_c,)
    xi_columns: IntArray  # (n_c, 2), -1 where constant
    theta_columns: IntArray  # (n_c, 3), -1 where constant
    components: IntArray  # (k,) rows of a twist that count: all six, or x, y, omega_z


class StateArrays(NamedTuple):
    """What `evaluate` computes; base frame unless said otherwise."""

    joint_rotations: FloatArray  # (n_q, 3, 3)
    joint_origins: FloatArray  # (n_q, 3)
    joint_axes: FloatArray  # (n_q, 3)
    tip_positions: FloatArray  # (n_c, 3)
    tip_rotations: FloatArray  # (n_c, 3, 3)
    tip_jacobians: FloatArray  # (n_c, 6, n_q)
    surface_points: FloatArray  # (n_c, 3) object frame
    surface_tangents: FloatArray  # (n_c, 3, 2) object frame
    surface_normals: FloatArray  # (n_c, 3) object frame
    surface_spins: FloatArray  # (n_c, 3, 2) object frame
    object_positions: FloatArray  # (n_c, 3) as each extended finger has it
    object_rotations: FloatArray  # (n_c, 3, 3)
    levers: FloatArray  # (n_c, 3) from the object's origin to the tip
    xi_jacobians: FloatArray  # (n_c, 2, n) contact coordinates' rates per unit of the variables
    jacobian: FloatArray  # (k n_c, n) stacked extended Jacobian
    euler_cosines: FloatArray  # (n_c,) cos theta_2


@njit(cache=True)
def evaluate(system: SystemArrays, joints: FloatArray, contacts: FloatArray, state: StateArrays) -> None:
    """Fill ``state`` at the joints, shape (n_q,), and contact variables [xi; theta], shape (n_c, 5)."""
    _forward(system, joints, state)
    state.jacobian[:] = 0.0
    state.xi_jacobians[:] = 0.0
    rows = len(system.components)
    derivatives, gauss, spin = np.empty((6, 3)), np.empty((3, 3)), np.empty((3, 2))
    relative, contact, rates, turning = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    column = np.zeros(6)
    for i in range(len(system.tip_joints)):
        chart_derivatives(
            system.chart_kinds[i], system.chart_parameters[i], contacts[i, 0], contacts[i, 1], derivatives
        )
        gauss_frame(derivatives, gauss, spin)
        theta = contacts[i, 2:]
        state.euler_cosines[i] = math.cos(theta[1])
        tip_rotation = state.tip_rotations[i]
        rotation = state.object_rotations[i]
        euler_matrix(theta, relative)
        matmul3(tip_rotation, relative, contact)
        for a in range(3):
            for b in range(3):
                rotation[a, b] = (
                    contact[a, 0] * gauss[b, 0] + contact[a, 1] * gauss[b, 1] + contact[a, 2] * gauss[b, 2]
                )
        radius = system.tip_radii[i]
        for a in range(3):
            state.surface_points[i, a] = derivatives[0, a]
            state.surface_normals[i, a] = gauss[a, 2]
            for b in range(2):
                state.surface_tangents[i, a, b] = derivatives[1 + b, a]
                state.surface_spins[i, a, b] = spin[a, b]
        for a in range(3):
            lever = 0.0
            for b in range(3):
                lever += rotation[a, b] * (derivatives[0, b] + radius * gauss[b, 2])
            state.levers[i, a] = lever
            state.object_positions[i, a] = state.tip_positions[i, a] - lever

        euler_rates(theta, rates)
        matmul3(tip_rotation, rates, turning)
        _xi_rates(system, i, derivatives, gauss, rotation, turning, state.xi_jacobians[i])

        for q in range(len(joints)):
            if system.paths[i, q]:
                for r in range(rows):
                    state.jacobian[i * rows + r, q] = state.tip_jacobians[i, system.components[r], q]
        for a in range(3):
            variable = system.theta_columns[i, a]
            if variable >= 0:
                column[:3] = 0.0
                for b in range(3):
                    column[3 + b] = turning[b, a]
                for r in range(rows):
                    state.jacobian[i * rows + r, variable] += column[system.components[r]]
        for k in range(2):
            # J_xi: the tip rides on the surface offset by its radius, whose tangents are c_xi + r n_xi
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                offset = spin[b, k] * gauss[c, 2] - spin[c, k] * gauss[b, 2]
                derivatives[3, a] = derivatives[1 + k, a] + radius * offset
            for a in range(3):
                column[a], column[3 + a] = 0.0, 0.0
                for b in range(3):
                    column[a] += rotation[a, b] * derivatives[3, b]
                    column[3 + a] += rotation[a, b] * spin[b, k]
            _spread(state.jacobian, state.xi_jacobians[i, k], column, system, i)


@njit(cache=True)
def _spread(
    jacobian: FloatArray, rates: FloatArray, column: FloatArray, system: SystemArrays, i: int
) -> None:
    """Subtract ``column`` x (rates of one contact coordinate) from the contact's rows."""
    rows = len(system.components)
    for k in range(2):
        variable = system.xi_columns[i, k]
        if variable >= 0 and rates[variable] != 0.0:
            for r in range(rows):
                jacobian[i * rows + r, variable] -= column[system.components[r]] * rates[variable]
    if system.rolling[i]:
        for k in range(3):
            variable = system.theta_columns[i, k]
            if variable >= 0:
                for r in range(rows):
                    jacobian[i * rows + r, variable] -= column[system.components[r]] * rates[variable]


@njit(cache=True)
def _xi_rates(
    system: SystemArrays,
    i: int,
    derivatives: FloatArray,
    gauss: FloatArray,
    rotation: FloatArray,
    turning: FloatArray,
    out: FloatArray,
) -> None:
    """Write how fast (u, v) run per unit of each variable, shape (2, n).

    A sliding contact's are variables of their own. A spherical tip that rolls without slip moves its
    contact by c_xi xi' = r n x (R_o^T R_f T theta'), from equal material velocities at the contact.
    """
    if not system.rolling[i]:
        for k in range(2):
            if system.xi_columns[i, k] >= 0:
                out[k, system.xi_columns[i, k]] = 1.0
        return
    uu, uv, vv = 0.0, 0.0, 0.0
    for a in range(3):
        uu += derivatives[1, a] * derivatives[1, a]
        uv += derivatives[1, a] * derivatives[2, a]
        vv += derivatives[2, a] * derivatives[2, a]
    spin = np.empty(3)
    for k in range(3):
        variable = system.theta_columns[i, k]
        if variable < 0:
            continue
        for a in range(3):
            spin[a] = (
                rotation[0, a] * turning[0, k]
                + rotation[1, a] * turning[1, k]
                + rotation[2, a] * turning[2, k]
            )
        along_u, along_v = 0.0, 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            slip = system.tip_radii[i] * (gauss[b, 2] * spin[c] - gauss[c, 2] * spin[b])
            along_u += derivatives[1, a] * slip
            along_v += derivatives[2, a] * slip
        determinant = uu * vv - uv * uv
        out[0, variable] = (vv * along_u - uv * along_v) / determinant
        out[1, variable] = (uu * along_v - uv * along_u) / determinant


@njit(cache=True)
def _forward(system: SystemArrays, joints: FloatArray, state: StateArrays) -> None:
    """Forward kinematics of the tree and the tips' geometric Jacobians (4.1)."""
    turn, placed = np.empty((3, 3)), np.empty((3, 3))
    for j in range(len(joints)):
        parent = system.parents[j]
        place, shift = system.placement_rotations[j], system.placement_translations[j]
        axis_angle_matrix(system.axes[j], joints[j], turn)
        if parent < 0:
            matmul3(place, turn, state.joint_rotations[j])
            for a in range(3):
                state.joint_origins[j, a] = shift[a]
        else:
            base = state.joint_rotations[parent]
            matmul3(base, place, placed)
            matmul3(placed, turn, state.joint_rotations[j])
            for a in range(3):
                state.joint_origins[j, a] = (
                    state.joint_origins[parent, a]
                    + base[a, 0] * shift[0]
                    + base[a, 1] * shift[1]
                    + base[a, 2] * shift[2]
                )
        r, axis = state.joint_rotations[j], system.axes[j]
        for a in range(3):
            state.joint_axes[j, a] = r[a, 0] * axis[0] + r[a, 1] * axis[1] + r[a, 2] * axis[2]
    for i in range(len(system.tip_joints)):
        j = system.tip_joints[i]
        r, shift = state.joint_rotations[j], system.tip_translations[i]
        matmul3(r, system.tip_rotations[i], state.tip_rotations[i])
        for a in range(3):
            state.tip_positions[i, a] = (
                state.joint_origins[j, a] + r[a, 0] * shift[0] + r[a, 1] * shift[1] + r[a, 2] * shift[2]
            )
        for q in range(len(joints)):
            if system.paths[i, q]:
                for a in range(3):
                    b, c = (a + 1) % 3, (a + 2) % 3
                    lever_b = state.tip_positions[i, b] - state.joint_origins[q, b]
                    lever_c = state.tip_positions[i, c] - state.joint_origins[q, c]
                    axes = state.joint_axes
                    state.tip_jacobians[i, a, q] = axes[q, b] * lever_c - axes[q, c] * lever_b
                    state.tip_jacobians[i, 3 + a, q] = axes[q, a]


@njit(cache=True)
def respond(
    system: SystemArrays,
    joints: FloatArray,
    contacts: FloatArray,
    state: StateArrays,
    position: FloatArray,
    rotation: FloatArray,
    twist: FloatArray,
    gain: FloatArray,
    feedback_only: bool,
    errors: FloatArray,
    out: FloatArray,
) -> float:
    """Do `evaluate` and `contact_twists` in one call; return the smallest cos theta_2."""
    evaluate(system, joints, contacts, state)
    contact_twists(system, state, position, rotation, twist, gain, feedback_only, errors, out)
    smallest = 1.0
    for i in range(len(state.euler_cosines)):
        smallest = min(smallest, state.euler_cosines[i])
    return smallest


@njit(cache=True)
def contact_twists(
    system: SystemArrays,
    state: StateArrays,
    position: FloatArray,
    rotation: FloatArray,
    twist: FloatArray,
    gain: FloatArray,
    feedback_only: bool,
    errors: FloatArray,
    out: FloatArray,
) -> None:
    """Write G_i^T (v_d + K e_i) of every contact, stacked, into ``out``, shape (k n_c,) (4.10).

    Args:
        system: The system.
        state: Its state.
        position: Desired position of the object's origin, shape (3,).
        rotation: Desired orientation, shape (3, 3).
        twist: Desired twist v_d, shape (6,).
        gain: Diagonal of K, shape (6,), 1/s.
        feedback_only: Leave v_d out, as the transpose algorithm does (4.12).
        errors: The pose errors e_i, one loop a finger, shape (n_c, 6).
        out: The result.
    """
    rows = len(system.components)
    wanted, moved = np.empty(6), np.empty(6)
    for i in range(len(system.tip_joints)):
        for a in range(3):
            errors[i, a] = position[a] - state.object_positions[i, a]
        rotation_error(rotation, state.object_rotations[i], errors[i, 3:])
        for a in range(6):
            wanted[a] = gain[a] * errors[i, a] + (0.0 if feedback_only else twist[a])
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            moved[a] = wanted[a] + wanted[3 + b] * state.levers[i, c] - wanted[3 + c] * state.levers[i, b]
            moved[3 + a] = wanted[3 + a]
        for r in range(rows):
            out[i * rows + r] = moved[system.components[r]]
