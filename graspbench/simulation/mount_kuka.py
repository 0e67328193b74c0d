"""The hand on the flange of a KUKA LBR iiwa that stands beside the object."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping

import numpy as np
import pybullet

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.hand.model import HandModel
from graspbench.simulation.mount_arm import ARM_JOINTS, WRIST_LINK, arm_urdf
from graspbench.simulation.mount_placement import Placement
from graspbench.simulation.wrist import hand_robot, light_link

_MOST_TORQUE_NM = 300.0
_POSITION_GAIN = 0.3
_LOST_M = 0.002


class KukaArm:
    """An arm of seven joints under position control; the palm's goals become joints by inverse kinematics.

    The arm and the hand are one body of PyBullet. The motors are constraints of the solver within the torque
    limits of the arm's description: they carry the weight without a lag.

    Args:
        hand: The hand.
        placement: Where the arm stands, with which bracket, and its first joints.
    """

    def __init__(self, hand: HandModel, placement: Placement) -> None:
        self._hand, self._arm, self.placement = hand, placement.arm, placement
        self._world_to_base = np.linalg.inv(placement.transform_base_to_world)
        self._goal = placement.joints
        self._wanted = np.full((4, 4), np.nan)
        self._still = False
        self._client, self._body = -1, -1
        self._joint_ids: list[int] = []

    @property
    def base_to_world(self) -> FloatArray:
        """Pose of the arm's fixed base, shape (4, 4)."""
        return self.placement.transform_base_to_world

    @property
    def solver_iterations(self) -> int:
        """With fewer, contacts creep: a cylinder slides 1.0 mm instead of 0.55 mm while it is tilted."""
        return 150

    @property
    def tilt_direction(self) -> float:
        """Which way the wrist tilts after the lift: the way in which the arm's wrist stays off the table."""
        return self.placement.tilt_direction

    def urdf(self) -> str:
        """Return the URDF of arm and hand in one."""
        return arm_with_hand(self._hand, self._arm.transform_root_to_wrist)

    def attach(self, client: int, body: int, joint_ids: Mapping[str, int]) -> None:
        """Take over the arm's joints of a loaded body, and put them at the start."""
        self._client, self._body = client, body
        self._joint_ids = [joint_ids[name] for name in ARM_JOINTS]
        for joint, value in zip(self._joint_ids, self._goal, strict=True):
            pybullet.resetJointState(body, joint, value, 0.0, physicsClientId=client)

    def drive(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step.

        Raises:
            SimulationError: A joint would leave its range or move too fast, or the goal is out of reach.
        """
        if np.array_equal(transform_palm_to_world, self._wanted):
            if self._still:
                return  # its motors hold the goal they have
            goal, self._still = self._goal, True
        else:
            wanted = self._world_to_base @ transform_palm_to_world
            goal, self._still = self._arm.follow(self._goal, wanted, time_step_s), False
            self._check(goal, (goal - self._goal) / time_step_s, wanted)
        speed = (goal - self._goal) / time_step_s
        self._goal, self._wanted = goal, transform_palm_to_world.copy()
        pybullet.setJointMotorControlArray(
            self._body,
            self._joint_ids,
            pybullet.POSITION_CONTROL,
            targetPositions=goal.tolist(),
            targetVelocities=speed.tolist(),
            forces=[_MOST_TORQUE_NM] * len(goal),
            positionGains=[_POSITION_GAIN] * len(goal),
            velocityGains=[1.0] * len(goal),
            physicsClientId=self._client,
        )

    def palm_pose(self) -> FloatArray:
        """Return transform_palm_to_world, shape (4, 4), from the arm's real joints."""
        states = pybullet.getJointStates(self._body, self._joint_ids, physicsClientId=self._client)
        pose: FloatArray = self.base_to_world @ self._arm.palm_pose(np.array([s[0] for s in states]))
        return pose

    def _check(self, goal: FloatArray, speed: FloatArray, wanted: FloatArray) -> None:
        arm = self._arm
        if (out := np.flatnonzero((goal < arm.lower) | (goal > arm.upper))).size:
            what = f"joint {out[0] + 1} of the arm would leave its range"
        elif (fast := np.flatnonzero(np.abs(speed) > arm.speed_limits)).size:
            k = fast[0]
            what = f"joint {k + 1} of the arm would have to move at {np.degrees(abs(speed[k])):.0f} deg/s"
        elif np.linalg.norm(arm.palm_pose(goal)[:3, 3] - wanted[:3, 3]) > _LOST_M:
            what = "the palm's goal is out of the arm's reach"
        else:
            return
        raise SimulationError(what, remedy="move slower or less far, or choose execution.mount=floating")


def arm_with_hand(hand: HandModel, transform_root_to_wrist: FloatArray) -> str:
    """Return one URDF of the arm with the hand's root link fixed to its last link.

    Mesh files become absolute paths, so the text may be stored anywhere; what is only seen is left out.

    Args:
        hand: The hand.
        transform_root_to_wrist: Pose of the hand's root link in the last link of the arm, shape (4, 4).

    Raises:
        HandError: A mesh file of the hand cannot be found.
    """
    path = arm_urdf()
    robot = ElementTree.parse(path).getroot()
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for mesh in robot.iter("mesh"):
        mesh.set("filename", str(path.parent / mesh.get("filename", "")))
    whole = ElementTree.Element("robot", name="arm_with_hand")
    # PyBullet places a body by its base link's centre of mass: let that be where the link is.
    whole.append(light_link("arm_base"))
    whole.append(_fixed("arm_on_base", "arm_base", robot.findall("link")[0].get("name", ""), np.eye(4)))
    whole.extend(part for part in robot if part.tag in ("link", "joint"))
    hand_tree, root = hand_robot(hand)
    whole.append(_fixed("hand_on_arm", WRIST_LINK, root, transform_root_to_wrist))
    whole.extend(hand_tree)
    return ElementTree.tostring(whole, encoding="unicode")


def _fixed(name: str, parent: str, child: str, pose: FloatArray) -> ElementTree.Element:
    joint = ElementTree.Element("joint", name=name, type="fixed")
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(
        joint,
        "origin",
        xyz=" ".join(f"{value:.15g}" for value in pose[:3, 3]),
        rpy=" ".join(f"{angle:.15g}" for angle in _roll_pitch_yaw(pose[:3, :3])),
    )
    return joint


def _roll_pitch_yaw(rotation: FloatArray) -> tuple[float, float, float]:
    """Return angles about fixed axes x, y, z as URDF has them, also where two of them do the same."""
    r = rotation
    cosine = math.hypot(r[0, 0], r[1, 0])
    pitch = math.atan2(-r[2, 0], cosine)
    if cosine > 1e-9:
        return math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])
    return 0.0, pitch, math.atan2(-r[0, 1], r[1, 1])
