"""What compiled kinematics wants to know of a system beforehand."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.kinematic_tree import KinematicTree


def joint_turns(tree: KinematicTree) -> FloatArray:
    """Return matrices A, B, C of each joint with A + cos q B + sin q C its rotation, shape (n_q, 3, 3, 3)."""
    turns = np.zeros((tree.n_joints, 3, 3, 3))
    for joint, (place, axis) in enumerate(zip(tree.placement_rotations, tree.axes, strict=True)):
        x, y, z = axis
        along = np.outer(axis, axis)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turns[joint] = place @ along, place @ (np.eye(3) - along), place @ cross
    return turns


class FingerGroups(NamedTuple):
    """The fields of `SystemArrays` about groups."""

    group_rows: IntArray
    group_row_starts: IntArray
    group_columns: IntArray
    group_column_starts: IntArray


def finger_groups(
    paths: IntArray, xi: IntArray, theta: IntArray, rows: int, n_variables: int
) -> FingerGroups:
    """Group contacts whose fingers share joints; see `SystemArrays`."""
    label = np.arange(len(paths))
    for i, path in enumerate(paths):
        for k in range(i):
            if np.any(path & paths[k]):
                label[label == label[i]] = label[k]
    group_rows, group_columns = [], []
    for group in np.unique(label):
        own = np.flatnonzero(label == group)
        contact = np.concatenate([xi[own].ravel(), theta[own].ravel()])
        group_columns.append(
            np.concatenate([np.flatnonzero(paths[own].any(axis=0)), np.sort(contact[contact >= 0])])
        )
        group_rows.append((rows * own[:, None] + np.arange(rows)).ravel())
    idle = np.setdiff1d(np.arange(n_variables), np.concatenate(group_columns))
    if idle.size:
        group_columns.append(idle)
        group_rows.append(np.zeros(0, dtype=np.int64))
    if any(len(r) > len(c) for r, c in zip(group_rows, group_columns, strict=True)):
        # a finger with too few variables of its own: only all fingers together can be factorised
        group_rows, group_columns = [np.arange(rows * len(paths))], [np.arange(n_variables)]
    return FingerGroups(
        np.concatenate(group_rows),
        _starts(group_rows),
        np.concatenate(group_columns),
        _starts(group_columns),
    )


def _starts(parts: Sequence[IntArray]) -> IntArray:
    return np.cumsum([0, *(len(part) for part in parts)], dtype=np.int64)
