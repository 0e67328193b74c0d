"""Kinematic trees as arrays: what the compiled kinematics needs of a hand."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import HandError


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """Revolute joints in a tree, and the finger frames S_f at its tips.

    Fingers may have joints of their own, share some (an arm, a palm), or all sit on one chain.

    Attributes:
        parents: Joint each joint is mounted on, -1 for the base, shape (n_q,); parents come first.
        placement_rotations: Orientation of each joint in its parent's frame, shape (n_q, 3, 3).
        placement_translations: Position of each joint in its parent's frame, shape (n_q, 3), m.
        axes: Unit axis of each joint in its own frame, shape (n_q, 3).
        tip_joints: Joint that carries each finger frame, shape (n_tips,).
        tip_rotations: Orientation of the finger frames in the frame of that joint, shape (n_tips, 3, 3).
        tip_translations: Their position there, shape (n_tips, 3), m.
        lower: Lower joint limits, shape (n_q,), rad; none by default.
        upper: Upper joint limits, shape (n_q,), rad.
        velocity_limits: Joint velocity limits, shape (n_q,), rad/s.
    """

    parents: IntArray
    placement_rotations: FloatArray
    placement_translations: FloatArray
    axes: FloatArray
    tip_joints: IntArray
    tip_rotations: FloatArray
    tip_translations: FloatArray
    lower: FloatArray = field(default_factory=lambda: np.zeros(0))
    upper: FloatArray = field(default_factory=lambda: np.zeros(0))
    velocity_limits: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        for name, sign in (("lower", -1.0), ("upper", 1.0), ("velocity_limits", 1.0)):
            if len(getattr(self, name)) != len(self.parents):
                object.__setattr__(self, name, np.full(len(self.parents), sign * np.inf))

    @property
    def n_joints(self) -> int:
        """Number of joints n_q."""
        return len(self.parents)

    @property
    def n_tips(self) -> int:
        """Number of finger frames."""
        return len(self.tip_joints)

    @cached_property
    def joints(self) -> IntArray:
        """All joints, shape (n_q,)."""
        return np.arange(self.n_joints, dtype=np.int64)

    @cached_property
    def mid_range(self) -> FloatArray:
        """Middle of the joints' ranges, 0 for joints without limits, shape (n_q,), rad."""
        bounded = np.isfinite(self.lower) & np.isfinite(self.upper)
        middle = np.zeros(self.n_joints)
        middle[bounded] = 0.5 * (self.lower[bounded] + self.upper[bounded])
        return middle

    def paths(self) -> IntArray:
        """Return which joints move which tip: 0 or 1, shape (n_tips, n_q)."""
        path = np.zeros((self.n_tips, self.n_joints), dtype=np.int64)
        for tip, joint in enumerate(self.tip_joints):
            at = int(joint)
            while at >= 0:
                path[tip, at] = 1
                at = int(self.parents[at])
        return path


def planar_tree(
    bases_m: FloatArray,
    parents: Sequence[int],
    lengths_m: Sequence[float],
    tip_joints: Sequence[int],
) -> KinematicTree:
    """Return a planar tree in the x-y plane: joints about z, links along the joints' x axes.

    Args:
        bases_m: Position of the joints that stand on the base, in order, shape (n_bases, 2).
        parents: Joint each joint is mounted on, or -1.
        lengths_m: Length of the link each joint moves.
        tip_joints: Joint whose link ends at each tip.
    """
    n, tips = len(parents), len(tip_joints)
    translations = np.zeros((n, 3))
    base = iter(np.asarray(bases_m, dtype=np.float64))
    for joint, parent in enumerate(parents):
        if parent < 0:
            translations[joint, :2] = next(base)
        else:
            translations[joint, 0] = lengths_m[parent]
    tip_translations = np.zeros((tips, 3))
    tip_translations[:, 0] = [lengths_m[joint] for joint in tip_joints]
    # A finger frame's x axis is the axis of the plane, so that a planar ball joint turns by theta_1.
    tip_rotation = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    return KinematicTree(
        np.array(parents, dtype=np.int64),
        np.tile(np.eye(3), (n, 1, 1)),
        translations,
        np.tile([0.0, 0.0, 1.0], (n, 1)),
        np.array(tip_joints, dtype=np.int64),
        np.tile(tip_rotation, (tips, 1, 1)),
        tip_translations,
    )


def tree_from_pinocchio(model: Any, frame_names: Sequence[str]) -> KinematicTree:
    """Return the tree of a Pinocchio model, with its joint order, and tips at the named frames.

    Raises:
        HandError: A joint is not revolute with one coordinate, or a frame is unknown.
    """
    import pinocchio as pin

    n = model.njoints - 1
    if model.nq != n or model.nv != n:
        raise HandError("the hand has joints other than plain revolute ones", remedy="lock or replace them")
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    axes = np.zeros((n, 3))
    for joint in range(1, n + 1):
        column = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)[:, joint - 1]
        axes[joint - 1] = column[3:]
        if abs(np.linalg.norm(column[3:]) - 1.0) > 1e-9 or model.joints[joint].idx_q != joint - 1:
            raise HandError(f"joint '{model.names[joint]}' is not revolute", joint=model.names[joint])
    placements = [model.jointPlacements[joint] for joint in range(1, n + 1)]
    frames = []
    for name in frame_names:
        if not model.existFrame(name):
            raise HandError(f"the hand has no frame '{name}'", frame=name)
        frames.append(model.frames[model.getFrameId(name)])
    return KinematicTree(
        np.array([model.parents[joint] - 1 for joint in range(1, n + 1)], dtype=np.int64),
        np.array([placement.rotation for placement in placements]),
        np.array([placement.translation for placement in placements]),
        axes,
        np.array([frame.parentJoint - 1 for frame in frames], dtype=np.int64),
        np.array([frame.placement.rotation for frame in frames]),
        np.array([frame.placement.translation for frame in frames]),
        np.array(model.lowerPositionLimit),
        np.array(model.upperPositionLimit),
        np.array(model.velocityLimit),
    )
