"""Compiled forward kinematics of a tree of revolute joints, and its tips' Jacobians."""

import math

from graspbench.compiled import inner
from graspbench.manipulation.compiled.rotations import matmul3
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays


@inner
def place_joints(system: SystemArrays, state: StateArrays) -> None:
    """Forward kinematics of the tree."""
    parents, turns, shifts, own_axes = (
        system.parents,
        system.joint_turns,
        system.placement_translations,
        system.axes,
    )
    joints, rotations = state.joints, state.joint_rotations
    origins, axes = state.joint_origins, state.joint_axes
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
def place_tips(system: SystemArrays, state: StateArrays) -> None:
    """Place the finger frames at the tips."""
    tip_joints, own_rotations, shifts = system.tip_joints, system.tip_rotations, system.tip_translations
    rotations, origins = state.joint_rotations, state.joint_origins
    tip_rotations, tips = state.tip_rotations, state.tip_positions
    for i in range(len(tip_joints)):
        j = tip_joints[i]
        base = rotations[j]
        matmul3(base, own_rotations[i], tip_rotations[i])
        for a in range(3):
            x, y, z = shifts[i, 0], shifts[i, 1], shifts[i, 2]
            tips[i, a] = origins[j, a] + base[a, 0] * x + base[a, 1] * y + base[a, 2] * z


@inner
def tip_jacobians(system: SystemArrays, state: StateArrays) -> None:
    """Write the tips' geometric Jacobians (4.1), each down its finger's own path."""
    parents, tip_joints, origins = system.parents, system.tip_joints, state.joint_origins
    axes, tips, jacobians = state.joint_axes, state.tip_positions, state.tip_jacobians
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
