"""Compiled forward kinematics of a tree of revolute joints, and its tips' Jacobians."""

import math

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.manipulation.rotations import matmul3


@inner
def place_joints(
    parents: IntArray,
    turns: FloatArray,
    shifts: FloatArray,
    own_axes: FloatArray,
    joints: FloatArray,
    rotations: FloatArray,
    origins: FloatArray,
    axes: FloatArray,
) -> None:
    """Forward kinematics of the tree."""
    for j in range(len(parents)):
        parent, rotation = parents[j], rotations[j]
        cosine, sine = math.cos(joints[j]), math.sin(joints[j])
        if parent < 0:
            for a in range(3):
                origins[j, a] = shifts[j, a]
                for b in range(3):
                    rotation[a, b] = turns[j, 0, a, b] + cosine * turns[j, 1, a, b] + sine * turns[j, 2, a, b]
        else:
            base = rotations[parent]
            for a in range(3):
                x, y, z = base[a, 0], base[a, 1], base[a, 2]
                origins[j, a] = origins[parent, a] + x * shifts[j, 0] + y * shifts[j, 1] + z * shifts[j, 2]
            for b in range(3):
                x = turns[j, 0, 0, b] + cosine * turns[j, 1, 0, b] + sine * turns[j, 2, 0, b]
                y = turns[j, 0, 1, b] + cosine * turns[j, 1, 1, b] + sine * turns[j, 2, 1, b]
                z = turns[j, 0, 2, b] + cosine * turns[j, 1, 2, b] + sine * turns[j, 2, 2, b]
                for a in range(3):
                    rotation[a, b] = base[a, 0] * x + base[a, 1] * y + base[a, 2] * z
        x, y, z = own_axes[j, 0], own_axes[j, 1], own_axes[j, 2]
        for a in range(3):
            axes[j, a] = rotation[a, 0] * x + rotation[a, 1] * y + rotation[a, 2] * z


@inner
def place_tips(
    tip_joints: IntArray,
    own_rotations: FloatArray,
    shifts: FloatArray,
    rotations: FloatArray,
    origins: FloatArray,
    tip_rotations: FloatArray,
    tips: FloatArray,
) -> None:
    """Place the finger frames at the tips."""
    for i in range(len(tip_joints)):
        j = tip_joints[i]
        base = rotations[j]
        matmul3(base, own_rotations[i], tip_rotations[i])
        for a in range(3):
            x, y, z = shifts[i, 0], shifts[i, 1], shifts[i, 2]
            tips[i, a] = origins[j, a] + base[a, 0] * x + base[a, 1] * y + base[a, 2] * z


@inner
def tip_jacobians(
    parents: IntArray,
    tip_joints: IntArray,
    origins: FloatArray,
    axes: FloatArray,
    tips: FloatArray,
    jacobians: FloatArray,
) -> None:
    """Write the tips' geometric Jacobians (4.1), each down its finger's own path."""
    for i in range(len(tip_joints)):
        j = tip_joints[i]
        while j >= 0:
            x, y, z = tips[i, 0] - origins[j, 0], tips[i, 1] - origins[j, 1], tips[i, 2] - origins[j, 2]
            jacobians[i, 0, j] = axes[j, 1] * z - axes[j, 2] * y
            jacobians[i, 1, j] = axes[j, 2] * x - axes[j, 0] * z
            jacobians[i, 2, j] = axes[j, 0] * y - axes[j, 1] * x
            for a in range(3):
                jacobians[i, 3 + a, j] = axes[j, a]
            j = parents[j]
