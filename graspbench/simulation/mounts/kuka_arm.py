"""The kinematics of an arm that can carry a hand, a KUKA LBR iiwa 14 as pybullet_data ships it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio
import pybullet_data
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel

ARM_JOINTS = tuple(f"lbr_iiwa_joint_{k}" for k in range(1, 8))
WRIST_LINK = "lbr_iiwa_link_7"

_TO_FLANGE_M = 0.045
_BRACKET_M = (0.03, 0.05)
"""Lengths along the flange's axis and along the palm's, room for the hand's own mounting plate."""

_BRACKET_DEG = 45.0
_BOLTINGS = 8
_LOW_LINKS = (4, 5, 6, 7)
_SPEED_LIMITS = np.radians([85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0])
_DAMPED = 1e-8 * np.eye(6)
_NO_DRIFT = np.zeros(7)
_CENTRING_RATE = 0.3


@dataclass(frozen=True)
class ArmState:
    """Where the arm is and how well it stands there.

    Attributes:
        joints: Joint positions, shape (7,), rad.
        error_m: Distance of the palm from its goal, a radian counting as a metre.
        margin: Distance of the joint nearest to its limit from it, as share of half its range.
        dexterity: Least singular value of the Jacobian, m and rad alike.
        lowest_m: Height of the lowest point of the forearm's and wrist's links above the arm's base.
    """

    joints: FloatArray
    error_m: float
    margin: float
    dexterity: float
    lowest_m: float


class ArmModel:
    """Kinematics of the arm with the hand's palm at its end.

    The URDF of pybullet_data states no speed limits; those of the LBR iiwa 14 R820 hold (KUKA's data sheet,
    85 to 135 deg/s).

    Args:
        hand: The hand.
        transform_palm_to_flange: How its palm is bolted on, shape (4, 4), such as `brackets` gives.

    Attributes:
        lower, upper: Joint limits, shape (7,), rad.
        speed_limits: Shape (7,), rad/s.
        transform_palm_to_wrist: Fixed pose of the palm in the last link's frame, shape (4, 4).
    """

    def __init__(self, hand: HandModel, transform_palm_to_flange: FloatArray) -> None:
        self._model = pinocchio.buildModelFromUrdf(str(arm_urdf()))
        self._hulls = {k: _hull_vertices(k) for k in _LOW_LINKS}
        self.transform_palm_to_wrist: FloatArray = transform_palm_to_flange.copy()
        self.transform_palm_to_wrist[2, 3] += _TO_FLANGE_M
        self.transform_root_to_wrist: FloatArray = self.transform_palm_to_wrist @ np.linalg.inv(
            hand.transform_palm_to_root
        )
        link = self._model.frames[self._model.getFrameId(WRIST_LINK)]
        placement = link.placement * pinocchio.SE3(self.transform_palm_to_wrist)
        self._palm = self._model.addFrame(
            pinocchio.Frame("palm", link.parentJoint, placement, pinocchio.FrameType.OP_FRAME)
        )
        self._data = self._model.createData()
        self.lower = np.array(self._model.lowerPositionLimit)
        self.upper = np.array(self._model.upperPositionLimit)
        self.speed_limits = _SPEED_LIMITS
        self._middle = 0.5 * (self.lower + self.upper)

    def palm_pose(self, joints: FloatArray) -> FloatArray:
        """Return the palm's pose in the arm's base frame, shape (4, 4)."""
        pinocchio.framesForwardKinematics(self._model, self._data, joints)
        return np.array(self._data.oMf[self._palm].homogeneous)

    def follow(
        self, joints: FloatArray, transform_palm_to_base: FloatArray, time_s: float, iterations: int = 2
    ) -> FloatArray:
        """Return joints that bring the palm to a pose near the present one: closed-loop inverse kinematics.

        Damped least squares on the pose's error; what freedom is left draws the joints slowly to the middle
        of their ranges (Siciliano et al., Robotics, section 3.7).

        Args:
            joints: Present joint positions, shape (7,).
            transform_palm_to_base: The goal, shape (4, 4).
            time_s: Time until then.
            iterations: Newton steps.
        """
        goal = pinocchio.SE3(transform_palm_to_base)
        q = joints.copy()
        drift = _CENTRING_RATE * time_s * (self._middle - joints)
        for _ in range(iterations):
            jacobian = self._jacobian(q)
            error = pinocchio.log6(self._data.oMf[self._palm].actInv(goal)).vector
            square = jacobian @ jacobian.T + _DAMPED
            q += drift + jacobian.T @ np.linalg.solve(square, error - jacobian @ drift)
            drift = _NO_DRIFT
        return q

    def reach(self, seed: FloatArray, transform_palm_to_base: FloatArray) -> FloatArray:
        """Return joints that bring the palm to a pose from afar, each within half a turn, shape (7,)."""
        q = seed.copy()
        for _ in range(25):
            before = q
            q = before + np.clip(self.follow(before, transform_palm_to_base, 0.5, 1) - before, -0.5, 0.5)
            if np.abs(q - before).max() < 0.01:
                break
        turned: FloatArray = (q + np.pi) % (2.0 * np.pi) - np.pi
        return self.follow(turned, transform_palm_to_base, 0.0, 3)

    def assess(self, joints: FloatArray, transform_palm_to_base: FloatArray) -> ArmState:
        """Say how well joints reach a pose."""
        jacobian = self._jacobian(joints)
        error = pinocchio.log6(self._data.oMf[self._palm].actInv(pinocchio.SE3(transform_palm_to_base)))
        room = np.minimum(joints - self.lower, self.upper - joints) / (0.5 * (self.upper - self.lower))
        return ArmState(
            joints=joints,
            error_m=float(np.linalg.norm(error.vector)),
            margin=float(room.min()),
            dexterity=float(np.linalg.svd(jacobian, compute_uv=False)[-1]),
            lowest_m=min(self._lowest(k) for k in _LOW_LINKS),
        )

    def _lowest(self, link: int) -> float:
        placement = self._data.oMi[link]
        return float((self._hulls[link] @ placement.rotation[2]).min() + placement.translation[2])

    def _jacobian(self, joints: FloatArray) -> FloatArray:
        pinocchio.computeJointJacobians(self._model, self._data, joints)
        pinocchio.updateFramePlacements(self._model, self._data)
        return np.array(
            pinocchio.getFrameJacobian(self._model, self._data, self._palm, pinocchio.ReferenceFrame.LOCAL)
        )


def brackets(grasping: FloatArray) -> tuple[FloatArray, ...]:
    """Return ways to bolt the palm to the flange, transform_palm_to_flange, each shape (4, 4).

    A straight bracket, and one of 45 degrees that keeps the wrist above the table when the palm approaches
    from the side, turned to that one of eight positions in which the wrist is highest.

    Args:
        grasping: transform_palm_to_world at the grasp, shape (4, 4).
    """
    turns = [
        Rotation.from_euler("ZY", [360.0 * k / _BOLTINGS, _BRACKET_DEG], degrees=True).as_matrix()
        for k in range(_BOLTINGS)
    ]
    steepest = min(turns, key=lambda flange_to_palm: float((grasping[:3, :3] @ flange_to_palm)[2, 2]))
    found = []
    for flange_to_palm in (np.eye(3), steepest):
        pose = np.eye(4)
        pose[:3, :3] = flange_to_palm.T
        pose[:3, 3] = [0.0, 0.0, _BRACKET_M[0]]
        pose[:3, 3] += _BRACKET_M[1] * pose[:3, 2]
        found.append(pose)
    return tuple(found)


@lru_cache
def _hull_vertices(link: int) -> FloatArray:
    """Return the vertices of a link's convex hull in its own frame, shape (n, 3)."""
    import trimesh

    mesh = trimesh.load_mesh(arm_urdf().parent / "meshes" / f"link_{link}.stl")
    return np.array(mesh.convex_hull.vertices)


def arm_urdf() -> Path:
    """Return the arm's description."""
    return Path(pybullet_data.getDataPath()) / "kuka_iiwa" / "model.urdf"
