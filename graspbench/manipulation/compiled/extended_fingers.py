"""Compiled kinematics of a hand, its contacts and the object (thesis 4.1 and 4.2)."""

import math

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import inner
from graspbench.manipulation.compiled.chart_formulas import chart_derivatives, gauss_frame
from graspbench.manipulation.compiled.forward_kinematics import place_joints, place_tips, tip_jacobians
from graspbench.manipulation.compiled.rotations import euler_matrix, euler_rates, matmul3
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays


@inner
def evaluate(system: SystemArrays, state: StateArrays) -> float:
    """Fill ``state`` from its joints and contact variables; return the smallest cos theta_2."""
    place_joints(system, state)
    place_tips(system, state)
    tip_jacobians(system, state)
    turning = np.empty((3, 3))
    state.jacobian[:] = 0.0
    state.xi_jacobians[:] = 0.0
    smallest = 1.0
    for i in range(len(system.tip_joints)):
        smallest = min(smallest, _place_object(system, state, i, turning))
        if system.rolling[i]:
            _rolling_rates(system, state, i, turning)
        else:
            _sliding_rates(system, state, i)
        _add_finger(system, state, i, turning)
        for k in range(2):
            _subtract_contact(system, state, i, k)
    return smallest


@inner
def _place_object(system: SystemArrays, state: StateArrays, i: int, turning: FloatArray) -> float:
    """Write the surface at contact i, where its finger has the object, and R_f T; return cos theta_2."""
    variables, radius, tips = state.contact_variables[i], system.tip_radii[i], state.tip_positions
    points, normals, tangents = state.surface_points, state.surface_normals, state.surface_tangents[i]
    positions, rotation, levers = state.object_positions, state.object_rotations[i], state.levers
    derivatives, gauss = np.empty((6, 3)), np.empty((3, 3))
    relative, contact = np.empty((3, 3)), np.empty((3, 3))
    chart_derivatives(
        system.chart_kinds[i],
        system.chart_rotations[i],
        system.chart_origins[i],
        system.chart_numbers[i],
        variables[0],
        variables[1],
        derivatives,
    )
    gauss_frame(derivatives, gauss, state.surface_spins[i])
    euler_rates(variables[2:], relative)
    matmul3(state.tip_rotations[i], relative, turning)
    euler_matrix(variables[2:], relative)
    matmul3(state.tip_rotations[i], relative, contact)
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
def _rows_of(system: SystemArrays, state: StateArrays, i: int) -> FloatArray:
    """Return the rows of contact i in the stacked Jacobian."""
    rows = len(system.twist_components)
    return state.jacobian[i * rows : (i + 1) * rows]


@inner
def _add_finger(system: SystemArrays, state: StateArrays, i: int, turning: FloatArray) -> None:
    """Write [J, J_theta] into a contact's rows; ``turning`` is R_f T."""
    parents, components, theta_columns = system.parents, system.twist_components, system.theta_columns[i]
    tip_jacobian, block, joint = state.tip_jacobians[i], _rows_of(system, state, i), system.tip_joints[i]
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
def riding(system: SystemArrays, state: StateArrays, i: int, k: int) -> tuple[float, float, float]:
    """Return how the tip's centre moves per unit of a contact coordinate, object frame.

    It rides on the surface offset by its radius, whose tangents are c_xi + r n_xi.
    """
    tangents, normal, spin = state.surface_tangents[i], state.surface_normals[i], state.surface_spins[i]
    radius = system.tip_radii[i]
    x = tangents[0, k] + radius * (spin[1, k] * normal[2] - spin[2, k] * normal[1])
    y = tangents[1, k] + radius * (spin[2, k] * normal[0] - spin[0, k] * normal[2])
    z = tangents[2, k] + radius * (spin[0, k] * normal[1] - spin[1, k] * normal[0])
    return x, y, z


@inner
def _subtract_contact(system: SystemArrays, state: StateArrays, i: int, k: int) -> None:
    """Subtract J_xi's column k, times its coordinate's rates, from a contact's rows."""
    spin, rotation = state.surface_spins[i], state.object_rotations[i]
    rates, block = state.xi_jacobians[i], _rows_of(system, state, i)
    components, xi_columns, theta_columns = (
        system.twist_components,
        system.xi_columns[i],
        system.theta_columns[i],
    )
    x, y, z = riding(system, state, i, k)
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
def _sliding_rates(system: SystemArrays, state: StateArrays, i: int) -> None:
    """Write the rates of contact coordinates that are variables themselves."""
    for k in range(2):
        if system.xi_columns[i, k] >= 0:
            state.xi_jacobians[i, k, system.xi_columns[i, k]] = 1.0


@inner
def _rolling_rates(system: SystemArrays, state: StateArrays, i: int, turning: FloatArray) -> None:
    """Write how fast (u, v) run per unit of each ball joint angle.

    A spherical tip that rolls without slip moves its contact by c_xi xi' = r n x (R_o^T R_f T theta'), from
    equal material velocities at the contact.
    """
    tangents, normal, rotation = (
        state.surface_tangents[i],
        state.surface_normals[i],
        state.object_rotations[i],
    )
    theta_columns, radius, out = system.theta_columns[i], system.tip_radii[i], state.xi_jacobians[i]
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
