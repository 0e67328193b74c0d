"""Compiled kinematics of a hand, its contacts and the object (thesis 4.1 and 4.2)."""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.manipulation.chart_kernels import chart_derivatives, gauss_frame
from graspbench.manipulation.forward_kinematics import place_joints, place_tips, tip_jacobians
from graspbench.manipulation.rotations import euler_matrix, euler_rates, matmul3
from graspbench.manipulation.state_arrays import StateArrays, SystemArrays


@inner
def evaluate(system: SystemArrays, state: StateArrays) -> float:
    """Fill ``state`` from its joints and contact variables; return the smallest cos theta_2."""
    place_joints(
        system.parents,
        system.turns,
        system.placement_translations,
        system.axes,
        state.joints,
        state.joint_rotations,
        state.joint_origins,
        state.joint_axes,
    )
    place_tips(
        system.tip_joints,
        system.tip_rotations,
        system.tip_translations,
        state.joint_rotations,
        state.joint_origins,
        state.tip_rotations,
        state.tip_positions,
    )
    tip_jacobians(
        system.parents,
        system.tip_joints,
        state.joint_origins,
        state.joint_axes,
        state.tip_positions,
        state.tip_jacobians,
    )
    derivatives, turning = np.empty((6, 3)), np.empty((3, 3))
    tangents, normals, spins = state.surface_tangents, state.surface_normals, state.surface_spins
    state.jacobian[:] = 0.0
    state.xi_jacobians[:] = 0.0
    smallest = 1.0
    for i in range(len(system.tip_joints)):
        smallest = min(
            smallest,
            _place_object(
                i,
                system.chart_kinds[i],
                system.chart_parameters[i],
                system.tip_radii[i],
                state.contact_variables[i],
                state.tip_positions,
                state.tip_rotations[i],
                derivatives,
                turning,
                state.surface_points,
                tangents[i],
                normals,
                spins[i],
                state.object_positions,
                state.object_rotations[i],
                state.levers,
            ),
        )
        rotation, rates = state.object_rotations[i], state.xi_jacobians[i]
        if system.rolling[i]:
            radius, theta = system.tip_radii[i], system.theta_columns[i]
            _rolling_rates(tangents[i], normals[i], rotation, turning, theta, radius, rates)
        else:
            for k in range(2):
                if system.xi_columns[i, k] >= 0:
                    rates[k, system.xi_columns[i, k]] = 1.0
        rows = len(system.components)
        block = state.jacobian[i * rows : (i + 1) * rows]
        _add_finger(
            system.parents,
            system.tip_joints[i],
            system.theta_columns[i],
            system.components,
            state.tip_jacobians[i],
            turning,
            block,
        )
        for k in range(2):
            _subtract_contact(
                k,
                tangents[i],
                normals[i],
                spins[i],
                rotation,
                system.tip_radii[i],
                system.components,
                system.xi_columns[i],
                system.theta_columns[i],
                rates,
                block,
            )
    return smallest


@inner
def _place_object(
    i: int,
    chart_kind: int,
    chart_parameters: FloatArray,
    radius: float,
    variables: FloatArray,
    tips: FloatArray,
    tip_rotation: FloatArray,
    derivatives: FloatArray,
    turning: FloatArray,
    points: FloatArray,
    tangents: FloatArray,
    normals: FloatArray,
    spin: FloatArray,
    positions: FloatArray,
    rotation: FloatArray,
    levers: FloatArray,
) -> float:
    """Write the surface at contact i, where its finger has the object, and R_f T; return cos theta_2."""
    gauss, relative, contact = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    chart_derivatives(chart_kind, chart_parameters, variables[0], variables[1], derivatives)
    gauss_frame(derivatives, gauss, spin)
    euler_rates(variables[2:], relative)
    matmul3(tip_rotation, relative, turning)
    euler_matrix(variables[2:], relative)
    matmul3(tip_rotation, relative, contact)
    for a in range(3):
        points[i, a], normals[i, a] = derivatives[0, a], gauss[a, 2]
        tangents[a, 0], tangents[a, 1] = derivatives[1, a], derivatives[2, a]
        lever = 0.0
        for b in range(3):
            rotation[a, b] = (
                contact[a, 0] * gauss[b, 0] + contact[a, 1] * gauss[b, 1] + contact[a, 2] * gauss[b, 2]
            )
            lever += rotation[a, b] * (derivatives[0, b] + radius * gauss[b, 2])
        levers[i, a] = lever
        positions[i, a] = tips[i, a] - lever
    return math.cos(variables[3])


@inner
def _add_finger(
    parents: IntArray,
    joint: int,
    theta_columns: IntArray,
    components: IntArray,
    tip_jacobian: FloatArray,
    turning: FloatArray,
    block: FloatArray,
) -> None:
    """Write [J, J_theta] into a contact's rows; ``turning`` is R_f T."""
    while joint >= 0:
        for r in range(len(components)):
            block[r, joint] = tip_jacobian[components[r], joint]
        joint = parents[joint]
    for k in range(3):
        if theta_columns[k] >= 0:
            for r in range(len(components)):
                if components[r] >= 3:
                    block[r, theta_columns[k]] = turning[components[r] - 3, k]


@inner
def _subtract_contact(
    k: int,
    tangents: FloatArray,
    normal: FloatArray,
    spin: FloatArray,
    rotation: FloatArray,
    radius: float,
    components: IntArray,
    xi_columns: IntArray,
    theta_columns: IntArray,
    rates: FloatArray,
    block: FloatArray,
) -> None:
    """Subtract J_xi's column k, times its coordinate's rates, from a contact's rows."""
    # the tip rides on the surface offset by its radius, whose tangents are c_xi + r n_xi
    x = tangents[0, k] + radius * (spin[1, k] * normal[2] - spin[2, k] * normal[1])
    y = tangents[1, k] + radius * (spin[2, k] * normal[0] - spin[0, k] * normal[2])
    z = tangents[2, k] + radius * (spin[0, k] * normal[1] - spin[1, k] * normal[0])
    for v in range(5):
        variable = xi_columns[v] if v < 2 else theta_columns[v - 2]
        if variable < 0 or rates[k, variable] == 0.0:
            continue
        for r in range(len(components)):
            a = components[r] % 3
            if components[r] < 3:
                moved = rotation[a, 0] * x + rotation[a, 1] * y + rotation[a, 2] * z
            else:
                moved = (
                    rotation[a, 0] * spin[0, k] + rotation[a, 1] * spin[1, k] + rotation[a, 2] * spin[2, k]
                )
            block[r, variable] -= moved * rates[k, variable]


@inner
def _rolling_rates(
    tangents: FloatArray,
    normal: FloatArray,
    rotation: FloatArray,
    turning: FloatArray,
    theta_columns: IntArray,
    radius: float,
    out: FloatArray,
) -> None:
    """Write how fast (u, v) run per unit of each ball joint angle, shape (2, n).

    A spherical tip that rolls without slip moves its contact by c_xi xi' = r n x (R_o^T R_f T theta'), from
    equal material velocities at the contact.
    """
    uu, uv, vv = 0.0, 0.0, 0.0
    for a in range(3):
        uu += tangents[a, 0] * tangents[a, 0]
        uv += tangents[a, 0] * tangents[a, 1]
        vv += tangents[a, 1] * tangents[a, 1]
    determinant = uu * vv - uv * uv
    spin = np.empty(3)
    for k in range(3):
        variable = theta_columns[k]
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
            slip = radius * (normal[b] * spin[c] - normal[c] * spin[b])
            along_u += tangents[a, 0] * slip
            along_v += tangents[a, 1] * slip
        out[0, variable] = (vv * along_u - uv * along_v) / determinant
        out[1, variable] = (uu * along_v - uv * along_u) / determinant
