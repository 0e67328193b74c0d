"""How tips, levers and contact normals change with a system's variables: what tasks in Python share."""

from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.manipulation.contact_kinematics import State


class ContactMotion(NamedTuple):
    """Rates of one finger's contact per unit of the variables, base frame.

    Attributes:
        tip: Of the tip's centre, shape (3, n).
        spin: Angular velocity of the object as this finger has it, shape (3, n).
        lever: Of the lever from the object's origin to the tip's centre, shape (3, n).
        normal: Of the outward normal, shape (3, n).
    """

    tip: FloatArray
    spin: FloatArray
    lever: FloatArray
    normal: FloatArray


def contact_motion(state: State, contact: int) -> ContactMotion:
    """Return how a contact moves with the variables: by (4.5), (4.9) and the chart's spin (4.4)."""
    system = state.system
    tip = np.zeros((3, system.n_variables))
    tip[:, : system.n_joints] = state.tip_jacobians[contact, :3]
    twist = np.zeros((6, system.n_variables))  # G^T v_o: of the object's point where the tip's centre is
    rows = slice(contact * system.rows, (contact + 1) * system.rows)
    twist[system.arrays.twist_components] = state.jacobian[rows]
    spin = twist[3:]
    lever = tip - twist[:3] + np.cross(spin, state.levers[contact], axisa=0, axisc=0)
    rotation = state.object_rotations[contact]
    normal = rotation @ state.surface_normals[contact]
    on_surface = rotation @ state.surface_spins[contact] @ state.xi_jacobians[contact]
    turning = np.cross(spin + on_surface, normal, axisa=0, axisc=0)
    return ContactMotion(tip, spin, lever, turning)


def joint_curvature(state: State, contact: int, along: FloatArray, joint_motion: FloatArray) -> FloatArray:
    """Return the gradient of ``along``' J ``joint_motion`` over the joints, J the tip's position Jacobian.

    Column j of J turns with joint k as axis_min(j, k) x column_max(j, k).

    Args:
        state: The system, evaluated.
        contact: The finger.
        along: Shape (3,).
        joint_motion: Shape (n_q,).

    Returns:
        Shape (n_q,).
    """
    path = np.flatnonzero(state.system.arrays.paths[contact])
    columns, axes = state.tip_jacobians[contact, :3, path], state.joint_axes[path]  # (p, 3) each
    # along . (axis x column), for axis of one joint and column of another
    mixed = np.cross(axes[:, None], columns[None]) @ along
    low = np.minimum.outer(np.arange(len(path)), np.arange(len(path)))
    high = np.maximum.outer(np.arange(len(path)), np.arange(len(path)))
    gradient = np.zeros(state.system.n_joints)
    gradient[path] = joint_motion[path] @ mixed[low, high]
    return gradient


def stacked_tips(state: State) -> FloatArray:
    """Return the position Jacobians of all tips, one below the other, shape (3 n_c, n_q)."""
    return state.tip_jacobians[:, :3].reshape(-1, state.system.n_joints)


def unit_twist(translation: tuple[float, ...], rotation: tuple[float, ...]) -> FloatArray:
    """Return a direction of translation and rotation, scaled to unit length, shape (6,)."""
    direction = np.array([*translation, *rotation], dtype=np.float64)
    return direction / np.linalg.norm(direction)


class Yielding(NamedTuple):
    """What b' (J C J' + c I)^-1 b is for a motion b of the tips, and how it changes with the variables.

    Attributes:
        value: The form.
        gradient: Shape (n,).
    """

    value: float
    gradient: FloatArray


def resistance(
    state: State, twist: FloatArray, joint_compliance: FloatArray, tip_compliance: float
) -> Yielding | None:
    """Return how much the fingers resist a motion of the object: u' G (J C J' + c I)^-1 G' u.

    With C = I and c = 0 it is the squared joint velocity that moves the object with the twist u.

    Args:
        state: The system, evaluated.
        twist: Translation and rotation u of the object, base frame, shape (6,).
        joint_compliance: Diagonal of C, shape (n_q,).
        tip_compliance: c.

    Returns:
        The form and its gradient; None at a singularity.
    """
    system, levers = state.system, state.levers
    jacobian = stacked_tips(state)
    matrix = (jacobian * joint_compliance) @ jacobian.T + tip_compliance * np.eye(len(jacobian))
    moved = (twist[:3] + np.cross(twist[3:], levers)).ravel()
    if np.linalg.cond(matrix) > 1e14:
        return None
    answer = np.asarray(np.linalg.solve(matrix, moved), dtype=np.float64)
    joints = joint_compliance * (jacobian.T @ answer)
    gradient = np.zeros(system.n_variables)
    for i in range(system.n_contacts):
        own = answer[3 * i : 3 * i + 3]
        gradient += 2.0 * np.cross(own, twist[3:]) @ contact_motion(state, i).lever
        gradient[: system.n_joints] -= 2.0 * joint_curvature(state, i, own, joints)
    return Yielding(float(moved @ answer), gradient)
