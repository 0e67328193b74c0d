"""The hand on the flange of an arm that stands beside the object."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from typing import Self

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.hand.model import HandModel
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.mounts.arm_model import ArmModel, carrying_arms
from graspbench.simulation.mounts.arm_placement import Placement, place_arm
from graspbench.simulation.mounts.motors import MountMotors
from graspbench.simulation.mounts.mount import PalmTask
from graspbench.simulation.mounts.urdf import fixed_joint, hand_robot, light_link, roll_pitch_yaw

_LOST_M = 0.002
_LOOK_EVERY = 8


class ArmMount:
    """An arm under position control; the palm's goals become joints by inverse kinematics.

    The arm and the hand are one body of PyBullet. The motors are constraints of the solver within the torque
    limits of the arm's description: they carry the weight without a lag.

    Args:
        hand: The hand.
        placement: Where the arm stands, with which bracket, and its first joints.
    """

    def __init__(self, hand: HandModel, placement: Placement) -> None:
        self._hand, self._arm, self.placement = hand, placement.arm, placement
        self._world_to_base = np.linalg.inv(placement.transform_base_to_world)
        self._motors = MountMotors(
            placement.arm.arm.joints, placement.arm.arm.effort_limits, placement.joints
        )
        self._wanted = np.full((4, 4), np.nan)
        self._still = False
        self._until_looked_at = 0

    @classmethod
    def for_task(cls, arm: ArmParameters, hand: HandModel, task: PalmTask) -> Self:
        """Return an arm that stands where it can do a task, at its start.

        Raises:
            HandError: The arm cannot be read.
            SimulationError: It can do the task from no place beside the object.
        """
        return cls(hand, place_arm(carrying_arms(arm, hand, task.grasping), task))

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
        return arm_with_hand(self._hand, self._arm)

    def attach(self, client: int, body: int, joint_ids: Mapping[str, int]) -> None:
        """Take over the arm's joints of a loaded body, and put them at the start."""
        self._motors.attach(client, body, joint_ids)

    def drive(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step.

        Raises:
            SimulationError: A joint would leave its range or move too fast, or the goal is out of reach.
        """
        goal = self._motors.goal
        if np.array_equal(transform_palm_to_world, self._wanted):
            if self._still:
                return  # its motors hold the goal they have
            self._still = True
        else:
            wanted, before = self._world_to_base @ transform_palm_to_world, goal
            goal, self._still = self._arm.follow(before, wanted, time_step_s), False
            self._check(goal, (goal - before) / time_step_s, wanted)
        self._wanted = transform_palm_to_world.copy()
        self._motors.drive(goal, time_step_s)

    def palm_pose(self) -> FloatArray:
        """Return transform_palm_to_world, shape (4, 4), from the arm's real joints."""
        pose: FloatArray = self.base_to_world @ self._arm.palm_pose(self._motors.positions())
        return pose

    def _hit(self, goal: FloatArray) -> tuple[str, str] | None:
        """Return what would hit each other, looked at every few steps."""
        self._until_looked_at -= 1
        if self._until_looked_at >= 0:
            return None
        self._until_looked_at = _LOOK_EVERY - 1
        return self._arm.bodies.first_hit(goal[None])

    def _check(self, goal: FloatArray, speed: FloatArray, wanted: FloatArray) -> None:
        arm = self._arm
        if (out := np.flatnonzero((goal < arm.lower) | (goal > arm.upper))).size:
            what = f"joint {out[0] + 1} of the arm would leave its range"
        elif (fast := np.flatnonzero(np.abs(speed) > arm.speed_limits)).size:
            k = fast[0]
            what = f"joint {k + 1} of the arm would have to move at {np.degrees(abs(speed[k])):.0f} deg/s"
        elif np.linalg.norm(arm.palm_pose(goal)[:3, 3] - wanted[:3, 3]) > _LOST_M:
            what = "the palm's goal is out of the arm's reach"
        elif (met := self._hit(goal)) is not None:
            what = f"{met[0]} of the arm and {met[1]} would hit each other"
        else:
            return
        raise SimulationError(what, remedy="move slower or less far, or choose arm=floating")


def arm_with_hand(hand: HandModel, arm: ArmModel) -> str:
    """Return one URDF of the arm with the hand's root link fixed to the link that carries it.

    Mesh files are absolute paths, so the text may be stored anywhere; what is only seen is left out.

    Args:
        hand: The hand.
        arm: The arm, with the hand bolted on.
    """
    robot = ElementTree.fromstring(arm.arm.urdf)
    whole = ElementTree.Element("robot", name="arm_with_hand")
    # PyBullet places a body by its base link's centre of mass: let that be where the link is.
    whole.append(light_link("arm_base"))
    whole.append(fixed_joint("arm_on_base", "arm_base", arm.arm.root, (0, 0, 0), (0, 0, 0)))
    whole.extend(robot)
    hand_tree, root = hand_robot(hand)
    pose = arm.transform_root_to_tip
    whole.append(fixed_joint("hand_on_arm", arm.arm.tip, root, pose[:3, 3], roll_pitch_yaw(pose[:3, :3])))
    whole.extend(hand_tree)
    return ElementTree.tostring(whole, encoding="unicode")
