"""The kinematics of an arm that carries a hand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.mounts import arm_chain
from graspbench.simulation.mounts.arm_bodies import ArmBodies
from graspbench.simulation.mounts.arm_chain import Chain
from graspbench.simulation.mounts.arm_file import ArmFile, kinematic_model, read_arm

_BRACKET_M = (0.03, 0.05)
"""Lengths along the flange's axis and along the palm's, room for the hand's own mounting plate."""

_BRACKETS_DEG = (0.0, 45.0, 90.0)
_BOLTINGS = 8
FIRST_LOW_JOINT = 2
"""Links from this joint on have to stay above the table: those before stand on it."""

_CENTRING_RATE, _NO_FREEDOM = 0.3, 6
_DRAWN, _EDGE, _TURN_M = 3000, 0.05, 0.3
_NEAREST, _ALIKE_RAD = 60, 0.7


@dataclass(frozen=True)
class ArmState:
    """Where the arm is and how well it stands there.

    Attributes:
        joints: Joint positions, shape (n,), rad or m.
        error_m: Distance of the palm from its goal, a radian counting as a metre.
        margins: Distance of each joint from the nearer limit, as share of half its range, shape (n,).
        dexterity: Least singular value of the Jacobian, m and rad alike.
        lowest_m: Height of the lowest point of the forearm's and wrist's links above the arm's base.
    """

    joints: FloatArray
    error_m: float
    margins: FloatArray
    dexterity: float
    lowest_m: float


class ArmModel:
    """Kinematics of an arm with the hand's palm at its end.

    Args:
        arm: The arm as it was read.
        hand: The hand.
        transform_palm_to_flange: How its palm is bolted on, shape (4, 4), such as `brackets` gives.

    Attributes:
        arm: The arm as it was read.
        n: Number of joints.
        lower, upper: Joint limits, shape (n,), rad or m.
        speed_limits: Shape (n,), rad/s or m/s.
        chain: The same for compiled code; see `graspbench.simulation.mounts.arm_chain`.
        centring_rate: Share of the way to the middle of its range that a joint drifts in a second, if it may.
        transform_root_to_tip: Fixed pose of the hand's root link in the link that carries it, shape (4, 4).
        pivot: Point about which the arm reaches, in its base's frame, shape (3,).
        reach_m: Farthest that the palm can be from there, an upper bound.
        bodies: What of it may hit each other, and the hand.
        turns_upright: Whether the first joint turns the arm about the base's z axis, as a turn of the base
            does.
    """

    def __init__(self, arm: ArmFile, hand: HandModel, transform_palm_to_flange: FloatArray) -> None:
        self.arm = arm
        self._model = kinematic_model(arm.urdf)
        self.n = int(self._model.nq)
        palm_to_tip = self._palm_to_tip = arm.transform_flange_to_tip @ transform_palm_to_flange
        self.transform_root_to_tip: FloatArray = palm_to_tip @ np.linalg.inv(hand.transform_palm_to_root)
        tip = self._model.frames[self._model.getFrameId(arm.tip)]
        placement = tip.placement * pinocchio.SE3(palm_to_tip)
        self.lower = np.array(self._model.lowerPositionLimit)
        self.upper = np.array(self._model.upperPositionLimit)
        self.speed_limits = arm.speed_limits
        self._middle = 0.5 * (self.lower + self.upper)
        self.centring_rate = _CENTRING_RATE if self.n > _NO_FREEDOM else 0.0
        self.chain = self._chain(placement)
        self.turns_upright = not arm.slides[0] and self._first_axis_is_upright()
        self.pivot, self.reach_m = self._reach()
        self.bodies = ArmBodies(arm, hand, palm_to_tip)

    def palm_pose(self, joints: FloatArray) -> FloatArray:
        """Return the palm's pose in the arm's base frame, shape (4, 4)."""
        return np.asarray(arm_chain.palm_pose(self.chain, joints))

    def jacobian(self, joints: FloatArray) -> FloatArray:
        """Return the palm's Jacobian in the arm's base frame, shape (6, n): velocity first, then turning."""
        return np.asarray(arm_chain.jacobian(self.chain, joints))

    def follow(
        self, joints: FloatArray, transform_palm_to_base: FloatArray, time_s: float, iterations: int = 2
    ) -> FloatArray:
        """Return joints that bring the palm to a pose near the present one: closed-loop inverse kinematics.

        Damped least squares on the pose's error; what freedom is left draws the joints slowly to the middle
        of their ranges (Siciliano et al., Robotics, section 3.7).

        Args:
            joints: Present joint positions, shape (n,).
            transform_palm_to_base: The goal, shape (4, 4).
            time_s: Time until then.
            iterations: Newton steps.
        """
        return np.asarray(
            arm_chain.follow(
                self.chain, joints, transform_palm_to_base, self.centring_rate * time_s, iterations
            )
        )

    def reach(self, seed: FloatArray, transform_palm_to_base: FloatArray) -> FloatArray:
        """Return joints that bring the palm to a pose from afar, each turned into its range, shape (n,)."""
        return np.asarray(arm_chain.reach(self.chain, seed, transform_palm_to_base, 0.5 * self.centring_rate))

    def path(self, joints: FloatArray, palms: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return the joints with which poses of the palm are followed, shape (t, n).

        Args:
            joints: Joint positions before the first, shape (n,).
            palms: Poses in the base frame, shape (t, 4, 4).
            times_s: Their times, shape (t,).
        """
        spans = np.diff(times_s, prepend=times_s[0])
        poses = np.ascontiguousarray(palms)
        return np.asarray(arm_chain.followed_path(self.chain, joints, poses, spans, self.centring_rate))

    def seeds(self, transform_palm_to_base: FloatArray, count: int) -> list[FloatArray]:
        """Return joints, unlike each other, that bring the palm near a pose, the nearest first.

        They are the best of some thousand random ones, the same at each call.

        Args:
            transform_palm_to_base: The goal, shape (4, 4).
            count: How many at most.
        """
        joints, tips = _drawn(self.arm)
        poses = tips @ self._palm_to_tip
        apart = np.linalg.norm(poses[:, :3, 3] - transform_palm_to_base[:3, 3], axis=1)
        cosine = 0.5 * (np.einsum("nij,ij->n", poses[:, :3, :3], transform_palm_to_base[:3, :3]) - 1.0)
        far = apart + _TURN_M * np.arccos(np.clip(cosine, -1.0, 1.0))
        found: list[FloatArray] = []
        for k in np.argsort(far, kind="stable")[:_NEAREST]:
            if all(np.abs(joints[k] - other).max() > _ALIKE_RAD for other in found):
                found.append(joints[k])
            if len(found) == count:
                break
        return found

    def assess(self, joints: FloatArray, transform_palm_to_base: FloatArray) -> ArmState:
        """Say how well joints reach a pose."""
        error_m, dexterity, lowest_m = arm_chain.assess(
            self.chain, joints, transform_palm_to_base, FIRST_LOW_JOINT
        )
        margins = np.minimum(joints - self.lower, self.upper - joints) / (0.5 * (self.upper - self.lower))
        return ArmState(joints, error_m, margins, dexterity, lowest_m)

    def _chain(self, palm: pinocchio.SE3) -> Chain:
        model, n = self._model, self.n
        places = [model.jointPlacements[k + 1].homogeneous[:3] for k in range(n)]
        data = model.createData()
        columns = [
            pinocchio.computeJointJacobian(model, data, pinocchio.neutral(model), k + 1)[:, k]
            for k in range(n)
        ]
        slides = np.array(self.arm.slides)
        axes = [column[:3] if slide else column[3:] for column, slide in zip(columns, slides, strict=True)]
        hulls = self.arm.hulls
        begins = np.cumsum([0, *(len(hull) for hull in hulls)])
        return (
            np.ascontiguousarray(places),
            np.ascontiguousarray(axes),
            slides,
            np.ascontiguousarray(palm.homogeneous[:3]),
            self.lower,
            self.upper,
            self._middle,
            np.ascontiguousarray(np.vstack(hulls)),
            begins,
        )

    def _first_axis_is_upright(self) -> bool:
        axis = np.asarray(self._model.jointPlacements[1].rotation) @ self.chain[1][0]
        return bool(axis[2] > 1.0 - 1e-6)

    def _reach(self) -> tuple[FloatArray, float]:
        """Return the point about which the arm reaches, and how far: links in line, slides drawn out."""
        placements = self._model.jointPlacements
        first, second = placements[1], placements[1] * placements[2]
        on_axis = self.turns_upright and np.linalg.norm((second.translation - first.translation)[:2]) < 1e-6
        start = 3 if on_axis and not self.arm.slides[1] else 2
        length = sum(float(np.linalg.norm(placements[k].translation)) for k in range(start, self.n + 1))
        length += float(np.linalg.norm(self.chain[3][:, 3]))
        slides = np.array(self.arm.slides)
        length += float(np.maximum(np.abs(self.lower), np.abs(self.upper))[slides].sum())
        return np.array((second if start == 3 else first).translation), length


@lru_cache(maxsize=4)
def _drawn(arm: ArmFile) -> tuple[FloatArray, FloatArray]:
    """Return random joints, shape (m, n), and the poses of the tip link for them, shape (m, 4, 4)."""
    model = kinematic_model(arm.urdf)
    data, tip = model.createData(), model.getFrameId(arm.tip)
    shares = np.random.default_rng(0).uniform(_EDGE, 1.0 - _EDGE, (_DRAWN, model.nq))
    joints = model.lowerPositionLimit + shares * (model.upperPositionLimit - model.lowerPositionLimit)
    poses = np.empty((_DRAWN, 4, 4))
    for each, pose in zip(joints, poses, strict=True):
        pinocchio.framesForwardKinematics(model, data, each)
        pose[:] = data.oMf[tip].homogeneous
    return joints, poses


def carrying_arms(p: ArmParameters, hand: HandModel, grasping: FloatArray) -> list[ArmModel]:
    """Return an arm with the hand bolted on in the ways that may suit a grasp.

    Args:
        p: The arm's description; a stated pose of the palm in its flange is the only way.
        hand: The hand.
        grasping: transform_palm_to_world at the grasp, shape (4, 4).

    Raises:
        HandError: The arm cannot be read.
    """
    arm = read_arm(p)
    if p.palm_xyz_m is None and p.palm_rpy_deg is None:
        return [ArmModel(arm, hand, bracket) for bracket in brackets(grasping)]
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", p.palm_rpy_deg or (0.0, 0.0, 0.0), degrees=True).as_matrix()
    pose[:3, 3] = p.palm_xyz_m or (0.0, 0.0, 0.0)
    return [ArmModel(arm, hand, pose)]


def brackets(grasping: FloatArray) -> tuple[FloatArray, ...]:
    """Return ways to bolt the palm to the flange, transform_palm_to_flange, each shape (4, 4).

    A straight bracket, and ones of 45 and 90 degrees that keep the wrist above the table when the palm
    approaches from the side, turned to that one of eight positions in which the wrist is highest.

    Args:
        grasping: transform_palm_to_world at the grasp, shape (4, 4).
    """
    found = []
    for angle in _BRACKETS_DEG:
        turns = [
            Rotation.from_euler("ZY", [360.0 * k / _BOLTINGS, angle], degrees=True).as_matrix()
            for k in range(_BOLTINGS if angle else 1)
        ]
        steepest = min(turns, key=lambda flange_to_palm: float((grasping[:3, :3] @ flange_to_palm)[2, 2]))
        pose = np.eye(4)
        pose[:3, :3] = steepest.T
        pose[:3, 3] = [0.0, 0.0, _BRACKET_M[0]]
        pose[:3, 3] += _BRACKET_M[1] * pose[:3, 2]
        found.append(pose)
    return tuple(found)
