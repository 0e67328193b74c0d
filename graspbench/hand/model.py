"""The hand model: a robot hand with a floating wrist, as the planners see it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray, cross
from graspbench.hand import kinematics
from graspbench.hand.chains import (
    DISC,
    LEADER,
    LEADER_FINGER,
    ROUND,
    SLIDES,
    VECTOR_OFFSET,
    VECTOR_RATIO,
    Chains,
    align_z,
    motion_axis,
)
from graspbench.hand.kinematics import FingerSolutions
from graspbench.hand.parameters import FileFrame, Margins
from graspbench.hand.shapes import Shapes


@dataclass(frozen=True)
class Follower:
    """A joint that follows another (URDF: mimic): position = ratio * the other's + offset.

    Attributes:
        name: The joint that follows.
        leader: The joint that it follows, one of ``HandModel.joint_names``.
        ratio: Rad or m of the joint per rad or m of its leader.
        offset: Its position where the leader is at 0, rad or m.
    """

    name: str
    leader: str
    ratio: float
    offset: float


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand of serial fingers; positions are in the palm frame.

    Its tips are spheres, or the collision shapes of the last links as they are (``tips_are_links``). The
    latter touch somewhere else in every grasp: ``touching.touching`` gives the hand whose tips are there.

    Attributes:
        name: Name of the hand.
        finger_names: Fingers in use, shape (n_f,).
        joint_names: Joints that move by themselves, idle ones included, in the order of every joint vector.
        followers: The joints that follow some of these.
        lower: Lower joint limits, shape (n_q,), rad (of a sliding joint, here and below: m).
        upper: Upper joint limits, shape (n_q,), rad.
        velocity_limits: Joint velocity limits, shape (n_q,), rad/s.
        effort_limits: Joint torque limits, shape (n_q,), N m.
        preferred: Preferred joints of a grasp; idle joints at rest, shape (n_q,), rad.
        rest: Joints while no finger is used, shape (n_q,), rad.
        tip_radius_m: Radius of the spherical fingertips; 0 where the last links touch, whose tips are points
            on their surfaces.
        pad_radius_m: Half the width of a fingertip, whatever its shape.
        tip_links: Link (or frame) of each finger's tip; its origin is the tip's centre.
        palm_link: Link the palm frame is fixed to.
        urdf_path: The hand's URDF file.
        package_dirs: Folders its ``package://`` references start from (search paths for PyBullet).
        transform_palm_to_root: Pose of the palm frame in the URDF's root link, shape (4, 4).
        symmetric: Whether the fingers are copies of each other, turned about the palm's z axis.
        margins: What a feasible posture has to keep.
        model: Pinocchio's model, base at the root link.
        geometry: Its collision geometry.
        chains: The fingers in use, for compiled kinematics.
        chain_joints: Numbers of Pinocchio's joints along each finger.
        freedom: In how many directions each finger can move its tip by itself, shape (n_f,).
        shapes: The collision shapes, for compiled distances; idle fingers count as palm.
        file_frames: How other benchmarks' files state the hand, by format.
        bare_tips: Fingers whose spheres the description lacks: they were added.
    """

    name: str
    finger_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    followers: tuple[Follower, ...]
    lower: FloatArray
    upper: FloatArray
    velocity_limits: FloatArray
    effort_limits: FloatArray
    preferred: FloatArray
    rest: FloatArray
    tip_radius_m: float
    pad_radius_m: float
    tip_links: tuple[str, ...]
    palm_link: str
    urdf_path: Path
    package_dirs: tuple[Path, ...]
    transform_palm_to_root: FloatArray
    symmetric: bool
    margins: Margins
    model: Any
    geometry: Any
    chains: Chains
    chain_joints: tuple[tuple[int, ...], ...]
    freedom: IntArray
    shapes: Shapes
    file_frames: Mapping[str, FileFrame] = field(default_factory=dict)
    bare_tips: tuple[str, ...] = ()

    @property
    def n_fingers(self) -> int:
        """Number of fingers in use."""
        return len(self.finger_names)

    @property
    def n_joints(self) -> int:
        """Number of joints, idle ones included."""
        return len(self.joint_names)

    @property
    def tips_are_links(self) -> bool:
        """Whether the fingers touch with the collision shapes of their last links."""
        return len(self.chains.elements) > 0

    @property
    def tip_reach_m(self) -> float:
        """How far a contact can be from the tip's nominal centre."""
        if not self.tips_are_links:
            return self.tip_radius_m
        chains, reach = self.chains, 0.0
        for f, (first, last) in enumerate(chains.spans):
            own = chains.elements[first:last]
            away = np.linalg.norm(own[:, :3] - chains.tips[f], axis=1) + own[:, DISC] + own[:, ROUND]
            reach = max(reach, float(away.max()))
        return reach

    @property
    def places_by_wrist(self) -> bool:
        """Whether some finger cannot place its tip by itself, so that the wrist has to make up for it.

        That is so of fingers that do not move their tips freely, and of tips that are links: where these
        touch depends on how they are turned.
        """
        return self.tips_are_links or not self.moves_tips_freely

    @property
    def moves_tips_freely(self) -> bool:
        """Whether every finger moves its tip in all directions, by joints that turn and are its own.

        Not of fingers of one or two joints, of parallel axes only, and, as the compiled solvers of a single
        finger do not know them, of joints that slide or follow others.
        """
        kinds = self.chains.kinds
        own = (kinds[..., LEADER_FINGER] == np.arange(self.n_fingers)[:, None]) & (
            kinds[..., LEADER] == np.arange(kinds.shape[1])
        )
        return bool(np.all(self.freedom == 3) and np.all(own) and not np.any(kinds[..., SLIDES] == 1))

    def finger_joints(self, finger: int) -> IntArray:
        """Return where the joints that move a finger are in the joint vector, palm to tip, shape (k,)."""
        index = self.chains.index[finger, : self.chains.counts[finger]]
        return index[np.sort(np.unique(index, return_index=True)[1])]

    def led_joints(self, finger: int) -> IntArray:
        """Return the positions in a finger's chain of the joints that its description gives, shape (k,).

        Those are all but the ones that follow another: of this finger, or of one before it.
        """
        kinds = self.chains.kinds[finger, : self.chains.counts[finger]]
        own = (kinds[:, LEADER_FINGER] == finger) & (kinds[:, LEADER] == np.arange(len(kinds)))
        return np.flatnonzero(own)

    def turned(self, finger: int) -> FloatArray:
        """Return the rotation from the last joint's frame in the chain, whose axis is z, to Pinocchio's."""
        joint = self.chain_joints[finger][-1]
        _, axis = motion_axis(self.model, joint, self.name)
        return align_z(axis)

    def last_rotation(self, finger: int, rows: FloatArray) -> FloatArray:
        """Return a finger's last joint's rotation in the palm frame, joints by finger, shape (3, 3)."""
        return np.asarray(_frames(self.chains, rows)[finger, self.chains.counts[finger] - 1, :, :3])

    def slides(self, finger: int, position: int) -> bool:
        """Return whether a joint of a finger's chain slides."""
        return bool(self.chains.kinds[finger, position, SLIDES])

    def by_finger(self, joints: FloatArray) -> FloatArray:
        """Return the joint vector as one row a finger, shape (n_f, k); short fingers are padded."""
        limits = self.chains.limits
        rows = joints[self.chains.index] * limits[..., VECTOR_RATIO] + limits[..., VECTOR_OFFSET]
        return np.ascontiguousarray(rows, dtype=float)

    def joint_vector(self, by_finger: FloatArray) -> FloatArray:
        """Return the joint vector of the rows of ``by_finger``; idle joints at rest, shape (n_q,)."""
        joints = self.preferred.copy()
        for f in range(self.n_fingers):
            count = self.chains.counts[f]
            rows, limits = by_finger[f, :count], self.chains.limits[f, :count]
            joints[self.chains.index[f, :count]] = (rows - limits[:, VECTOR_OFFSET]) / limits[:, VECTOR_RATIO]
        return joints

    def tip_positions(self, joints: FloatArray) -> FloatArray:
        """Return the tips' centres, palm frame, shape (n_f, 3)."""
        return _tips(self.chains, self.by_finger(joints))

    def tip_jacobians(self, joints: FloatArray) -> FloatArray:
        """Return the Jacobians of the tips' centres, palm frame, shape (n_f, 3, n_q), m/rad."""
        per_finger = _jacobians(self.chains, self.by_finger(joints))
        jacobians = np.zeros((self.n_fingers, 3, self.n_joints))
        for f in range(self.n_fingers):
            for k in range(self.chains.counts[f]):
                ratio = self.chains.limits[f, k, VECTOR_RATIO]
                jacobians[f, :, self.chains.index[f, k]] += ratio * per_finger[f, :, k]
        return jacobians

    def manipulability(self, joints: FloatArray) -> FloatArray:
        """Return every finger's manipulability sqrt(det(J J^T)), shape (n_f,) (Yoshikawa 1985)."""
        jacobians = self.tip_jacobians(joints)
        gram = jacobians @ jacobians.transpose(0, 2, 1)
        return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)))

    def finger_ik(
        self, finger: int, targets: FloatArray, start: FloatArray, *, centring: float = 0.2
    ) -> FingerSolutions:
        """Bring the tip of one finger to many targets, within the joint limits.

        Args:
            finger: Which finger.
            targets: Wanted tip centres, palm frame, shape (m, 3).
            start: Joints of this finger to start from, shape (k,) or (m, k).
            centring: How much the finger's free motion is used to move towards its preferred joints, 0 to 1.
                For fingers of three joints or more that turn and follow none (see ``places_by_wrist``).

        Returns:
            The solutions; ``error_m`` tells which targets are out of reach.
        """
        targets = np.ascontiguousarray(targets, dtype=float).reshape(-1, 3)
        m, k = targets.shape[0], int(self.chains.counts[finger])
        starts = np.broadcast_to(np.asarray(start, dtype=float), (m, k))
        joints, quantities = np.array(starts, order="C"), np.empty((3, m))
        kinematics.finger_ik_batch(self.chains, finger, targets, joints, centring, quantities)
        return FingerSolutions(joints, quantities[0], quantities[1], quantities[2])


def _frames(chains: Chains, joints: FloatArray) -> FloatArray:
    """Return the joint frames of all fingers, shape (f, k, 3, 4), in NumPy: quick to load."""
    n, k = joints.shape
    frames, fixed, turn = np.empty((n, k, 4, 4)), np.zeros((n, k, 4, 4)), np.zeros((n, k, 4, 4))
    fixed[:, :, :3], fixed[:, :, 3, 3] = chains.fixed[:, :k], 1.0
    slides = chains.kinds[:, :k, SLIDES] == 1
    angles = np.where(slides, 0.0, joints)
    turn[..., 0, 0] = turn[..., 1, 1] = np.cos(angles)
    turn[..., 1, 0] = np.sin(angles)
    turn[..., 0, 1] = -turn[..., 1, 0]
    turn[..., 2, 3] = np.where(slides, joints, 0.0)
    turn[..., 2, 2] = turn[..., 3, 3] = 1.0
    before = np.broadcast_to(np.eye(4), (n, 4, 4))
    for j in range(k):
        before = before @ fixed[:, j] @ turn[:, j]
        frames[:, j] = before
    return frames[:, :, :3]


def _tips(chains: Chains, joints: FloatArray) -> FloatArray:
    last = _frames(chains, joints)[np.arange(len(joints)), chains.counts - 1]
    return np.asarray(np.einsum("fij,fj->fi", last[:, :, :3], chains.tips) + last[:, :, 3])


def _jacobians(chains: Chains, joints: FloatArray) -> FloatArray:
    frames = _frames(chains, joints)
    last = frames[np.arange(len(joints)), chains.counts - 1]
    tips = np.einsum("fij,fj->fi", last[:, :, :3], chains.tips) + last[:, :, 3]
    arms = tips[:, None] - frames[..., 3]
    slides = (chains.kinds[..., SLIDES] == 1)[..., None]
    return np.where(slides, frames[..., 2], cross(frames[..., 2], arms)).transpose(0, 2, 1)


def shape_poses(chains: Chains, found: Shapes, joints: FloatArray) -> FloatArray:
    """Return the poses of a hand's collision shapes, palm frame, shape (s, 3, 4).

    Args:
        chains: The fingers.
        found: The shapes.
        joints: Joints by finger, shape (f, k).
    """
    frames = _frames(chains, joints)
    poses = found.local.copy()
    for s, (finger, link) in enumerate(found.index[:, :2]):
        if finger >= 0:
            frame = frames[finger, link]
            poses[s] = frame[:, :3] @ found.local[s]
            poses[s, :, 3] += frame[:, 3]
    return poses
