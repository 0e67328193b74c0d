"""The arrays of a manipulation system and of its state, each in one block of memory (see `memory`)."""

from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.memory import cube, matrix, shared, vector

_SIZES = 6


class SystemArrays(NamedTuple):
    """What does not change while the object moves; see `contact_kinematics.ManipulationSystem`.

    Contacts whose fingers share joints form a group; variables that move no contact form one more. Jt has no
    entries between groups.
    """

    turns: FloatArray  # (n_q, 3, 3, 3): a joint's rotation in its parent is [0] + cos q [1] + sin q [2]
    placement_translations: FloatArray  # (n_q, 3)
    axes: FloatArray  # (n_q, 3)
    tip_rotations: FloatArray  # (n_c, 3, 3)
    tip_translations: FloatArray  # (n_c, 3)
    tip_radii: FloatArray  # (n_c,)
    chart_parameters: FloatArray  # (n_c, p)
    parents: IntArray  # (n_q,)
    tip_joints: IntArray  # (n_c,)
    paths: IntArray  # (n_c, n_q)
    chart_kinds: IntArray  # (n_c,)
    rolling: IntArray  # (n_c,)
    xi_columns: IntArray  # (n_c, 2), -1 where constant
    theta_columns: IntArray  # (n_c, 3), -1 where constant
    components: IntArray  # (k,) rows of a twist that count: all six, or x, y, omega_z
    group_rows: IntArray  # (k n_c,) rows of Jt, group by group
    group_row_starts: IntArray  # (g + 1,)
    group_columns: IntArray  # (n,) columns of Jt, group by group
    group_column_starts: IntArray  # (g + 1,)


class StateArrays(NamedTuple):
    """A configuration and what follows from it; base frame unless said otherwise."""

    joints: FloatArray  # (n_q,)
    contact_variables: FloatArray  # (n_c, 5) [xi; theta]
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


class SystemMemory(NamedTuple):
    """The two blocks of a system."""

    numbers: FloatArray
    indices: IntArray


def pack_system(arrays: SystemArrays, n_variables: int) -> SystemMemory:
    """Return a system's arrays one after another, sizes first."""
    sizes = (
        len(arrays.parents),
        len(arrays.tip_joints),
        n_variables,
        len(arrays.components),
        arrays.chart_parameters.shape[1],
        len(arrays.group_row_starts) - 1,
    )
    numbers = [array.ravel() for array in arrays[:7]]
    indices = [array.ravel() for array in arrays[7:]]
    return SystemMemory(np.concatenate(numbers), np.concatenate([np.array(sizes, dtype=np.int64), *indices]))


def new_state_memory(system: SystemMemory) -> FloatArray:
    """Return room for a state of the system, all zeros."""
    q, c, n, rows = system.indices[:4]
    return np.zeros(16 * q + c * (50 + 6 * q + 2 * n + rows * n))


@shared
def system_arrays(numbers: FloatArray, indices: IntArray) -> SystemArrays:
    """Return the arrays of a system in its two blocks, without copying."""
    q, c, n = indices[0], indices[1], indices[2]
    rows, p, groups = indices[3], indices[4], indices[5]
    turns, at = vector(numbers, 0, 27 * q)
    placement_translations, at = matrix(numbers, at, q, 3)
    axes, at = matrix(numbers, at, q, 3)
    tip_rotations, at = cube(numbers, at, c, 3, 3)
    tip_translations, at = matrix(numbers, at, c, 3)
    tip_radii, at = vector(numbers, at, c)
    chart_parameters, at = matrix(numbers, at, c, p)
    parents, at = vector(indices, _SIZES, q)
    tip_joints, at = vector(indices, at, c)
    paths, at = matrix(indices, at, c, q)
    chart_kinds, at = vector(indices, at, c)
    rolling, at = vector(indices, at, c)
    xi_columns, at = matrix(indices, at, c, 2)
    theta_columns, at = matrix(indices, at, c, 3)
    components, at = vector(indices, at, rows)
    group_rows, at = vector(indices, at, rows * c)
    group_row_starts, at = vector(indices, at, groups + 1)
    group_columns, at = vector(indices, at, n)
    group_column_starts, at = vector(indices, at, groups + 1)
    return SystemArrays(
        turns.reshape((q, 3, 3, 3)),
        placement_translations,
        axes,
        tip_rotations,
        tip_translations,
        tip_radii,
        chart_parameters,
        parents,
        tip_joints,
        paths,
        chart_kinds,
        rolling,
        xi_columns,
        theta_columns,
        components,
        group_rows,
        group_row_starts,
        group_columns,
        group_column_starts,
    )


@shared
def state_arrays(memory: FloatArray, sizes: IntArray) -> StateArrays:
    """Return the arrays of a state in its block, without copying; ``sizes`` starts the system's indices."""
    q, c, n, rows = sizes[0], sizes[1], sizes[2], sizes[3]
    joints, at = vector(memory, 0, q)
    contact_variables, at = matrix(memory, at, c, 5)
    joint_rotations, at = cube(memory, at, q, 3, 3)
    joint_origins, at = matrix(memory, at, q, 3)
    joint_axes, at = matrix(memory, at, q, 3)
    tip_positions, at = matrix(memory, at, c, 3)
    tip_rotations, at = cube(memory, at, c, 3, 3)
    tip_jacobians, at = cube(memory, at, c, 6, q)
    surface_points, at = matrix(memory, at, c, 3)
    surface_tangents, at = cube(memory, at, c, 3, 2)
    surface_normals, at = matrix(memory, at, c, 3)
    surface_spins, at = cube(memory, at, c, 3, 2)
    object_positions, at = matrix(memory, at, c, 3)
    object_rotations, at = cube(memory, at, c, 3, 3)
    levers, at = matrix(memory, at, c, 3)
    xi_jacobians, at = cube(memory, at, c, 2, n)
    jacobian, at = matrix(memory, at, rows * c, n)
    return StateArrays(
        joints,
        contact_variables,
        joint_rotations,
        joint_origins,
        joint_axes,
        tip_positions,
        tip_rotations,
        tip_jacobians,
        surface_points,
        surface_tangents,
        surface_normals,
        surface_spins,
        object_positions,
        object_rotations,
        levers,
        xi_jacobians,
        jacobian,
    )
