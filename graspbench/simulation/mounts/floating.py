"""A wrist of six joints that floats in the world."""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from typing import Self

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel
from graspbench.simulation.mounts.motors import MountMotors
from graspbench.simulation.mounts.mount import PalmTask
from graspbench.simulation.mounts.urdf import (
    fixed_joint,
    hand_robot,
    light_link,
    roll_pitch_yaw,
    strong_joint,
)

WRIST_JOINTS = ("wrist_x", "wrist_y", "wrist_z", "wrist_rx", "wrist_ry", "wrist_rz")
_AXES = ("1 0 0", "0 1 0", "0 0 1") * 2
_FORCE = 1e4


class FloatingWrist:
    """Three sliding and three turning joints with motors that are stronger than anything they carry.

    Args:
        hand: The hand.
        transform_palm_to_world: Where the palm is first, shape (4, 4).
        tilt_axis: World direction, shape (3,), about which the wrist can turn without limit.
    """

    def __init__(self, hand: HandModel, transform_palm_to_world: FloatArray, tilt_axis: FloatArray) -> None:
        self._hand = hand
        root_to_palm = np.linalg.inv(hand.transform_palm_to_root)
        root = transform_palm_to_world @ root_to_palm
        self._base = np.eye(4)
        self._base[:3, :3] = _frame_along(tilt_axis)
        self._base[:3, 3] = root[:3, 3]
        self._world_to_base = np.linalg.inv(self._base)
        wrist_to_root = np.eye(4)
        wrist_to_root[:3, :3] = root[:3, :3].T @ self._base[:3, :3]
        self._rotation_root_to_wrist = wrist_to_root[:3, :3].T
        self._wrist_to_palm = root_to_palm @ wrist_to_root
        self._palm_to_wrist = np.linalg.inv(self._wrist_to_palm)
        self._wanted = transform_palm_to_world.copy()
        self._motors = MountMotors(WRIST_JOINTS, _FORCE, self._coordinates(transform_palm_to_world))
        self._still = False

    @classmethod
    def for_task(cls, hand: HandModel, task: PalmTask) -> Self:
        """Return a wrist at the start of a task."""
        return cls(hand, task.start, task.tilt_axis)

    @property
    def base_to_world(self) -> FloatArray:
        """Pose of the wrist's fixed base, shape (4, 4)."""
        return self._base

    @property
    def solver_iterations(self) -> int:
        """Its joints weigh next to nothing: as few iterations as the fingers need."""
        return 1

    @property
    def tilt_direction(self) -> float:
        """Which way the wrist tilts after the lift: it has no arm that would be in the way."""
        return 1.0

    def urdf(self) -> str:
        """Return the URDF of wrist and hand."""
        return mounted_urdf(self._hand, self._rotation_root_to_wrist)

    def attach(self, client: int, body: int, joint_ids: Mapping[str, int]) -> None:
        """Take over the wrist's joints of a loaded body, and put them at the start."""
        self._motors.attach(client, body, joint_ids)

    def drive(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step; the wrist's motors reach it."""
        if self._still and np.array_equal(transform_palm_to_world, self._wanted):
            return  # its motors hold the goal they have
        self._wanted = transform_palm_to_world.copy()
        goal, before = self._coordinates(transform_palm_to_world), self._motors.goal
        goal[3:] += 2 * np.pi * np.round((before[3:] - goal[3:]) / (2 * np.pi))
        self._still = not self._motors.drive(goal, time_step_s).any()

    def put(self, transform_palm_to_world: FloatArray) -> None:
        """Put the palm somewhere at once, at rest, shape (4, 4)."""
        self._wanted, self._still = transform_palm_to_world.copy(), False
        self._motors.put(self._coordinates(transform_palm_to_world))

    def palm_pose(self) -> FloatArray:
        """Return transform_palm_to_world, shape (4, 4), from the wrist's real joints."""
        pose: FloatArray = self._base @ wrist_pose(self._motors.positions()) @ self._palm_to_wrist
        return pose

    def _coordinates(self, transform_palm_to_world: FloatArray) -> FloatArray:
        return wrist_coordinates(self._world_to_base @ transform_palm_to_world @ self._wrist_to_palm)


def mounted_urdf(hand: HandModel, rotation_root_to_wrist: FloatArray) -> str:
    """Return the hand's URDF with three sliding and three turning joints before its root link.

    Mesh files become absolute paths, so the text may be stored anywhere.

    Args:
        hand: The hand.
        rotation_root_to_wrist: How the hand's root link is fixed to the last wrist link, shape (3, 3).
    """
    robot, root = hand_robot(hand)
    mount = ElementTree.Element("robot", robot.attrib)
    mount.append(light_link("wrist_base"))
    parent = "wrist_base"
    for name, axis in zip(WRIST_JOINTS, _AXES, strict=True):
        mount.append(light_link(f"{name}_link"))
        kind = "revolute" if "_r" in name else "prismatic"
        mount.append(strong_joint(name, kind, parent, f"{name}_link", axis))
        parent = f"{name}_link"
    angles = roll_pitch_yaw(rotation_root_to_wrist)
    mount.append(fixed_joint("wrist_mount", parent, root, (0, 0, 0), angles))
    mount.extend(robot)
    return ElementTree.tostring(mount, encoding="unicode")


def wrist_coordinates(pose_wrist_in_base: FloatArray) -> FloatArray:
    """Return the six wrist joints of a pose of the last wrist link in the base frame, shape (6,)."""
    r = pose_wrist_in_base
    second = math.atan2(r[0, 2], math.hypot(r[0, 0], r[0, 1]))
    if math.hypot(r[0, 0], r[0, 1]) > 1e-9:
        first, third = math.atan2(-r[1, 2], r[2, 2]), math.atan2(-r[0, 1], r[0, 0])
    else:  # gimbal lock: one of the two does for both
        first, third = 0.0, math.atan2(r[1, 0], r[1, 1])
    return np.array([r[0, 3], r[1, 3], r[2, 3], first, second, third])


def wrist_pose(coordinates: FloatArray) -> FloatArray:
    """Return the pose of the last wrist link in the base frame, shape (4, 4), for the six joints."""
    (a, b, c), (sa, sb, sc) = np.cos(coordinates[3:]), np.sin(coordinates[3:])
    return np.array(
        [
            [b * c, -b * sc, sb, coordinates[0]],
            [a * sc + sa * sb * c, a * c - sa * sb * sc, -sa * b, coordinates[1]],
            [sa * sc - a * sb * c, sa * c + a * sb * sc, a * b, coordinates[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _frame_along(axis: FloatArray) -> FloatArray:
    """Return a rotation whose first column is a direction, shape (3, 3)."""
    x = axis / np.linalg.norm(axis)
    y = np.cross(np.eye(3)[int(np.argmin(np.abs(x)))], x)
    y /= np.linalg.norm(y)
    return np.column_stack((x, y, np.cross(x, y)))
