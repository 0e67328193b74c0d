"""The joints of a mount under position control."""

from collections.abc import Mapping, Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.bullet import pybullet

POSITION_GAIN = 0.3


class MountMotors:
    """Motors that are constraints of the solver within a force: they carry the weight without a lag.

    Args:
        names: The joints' names in the URDF.
        forces: Largest force or torque of each, shape (n,), N or N m; or one number for all.
        start: First joint positions, shape (n,).

    Attributes:
        goal: Joint positions last asked for, shape (n,).
    """

    def __init__(self, names: Sequence[str], forces: FloatArray | float, start: FloatArray) -> None:
        self._names = tuple(names)
        self._forces = np.broadcast_to(forces, len(self._names)).tolist()
        self.goal = start
        self._client, self._body = -1, -1
        self._joint_ids: list[int] = []

    def attach(self, client: int, body: int, joint_ids: Mapping[str, int]) -> None:
        """Take over the joints of a loaded body, and put them at the start; see `Mount.attach`."""
        self._client, self._body = client, body
        self._joint_ids = [joint_ids[name] for name in self._names]
        for joint, value in zip(self._joint_ids, self.goal, strict=True):
            pybullet.resetJointState(body, joint, value, 0.0, physicsClientId=client)

    def drive(self, goal: FloatArray, time_step_s: float) -> FloatArray:
        """Set the goal for the end of the next step, shape (n,); return the speeds that it takes."""
        speed = (goal - self.goal) / time_step_s
        self.goal = goal
        n = len(goal)
        pybullet.setJointMotorControlArray(
            self._body,
            self._joint_ids,
            pybullet.POSITION_CONTROL,
            targetPositions=goal.tolist(),
            targetVelocities=speed.tolist(),
            forces=self._forces,
            positionGains=[POSITION_GAIN] * n,
            velocityGains=[1.0] * n,
            physicsClientId=self._client,
        )
        return speed

    def put(self, joints: FloatArray) -> None:
        """Put the joints somewhere at once, at rest, shape (n,)."""
        self.goal = joints
        for joint, value in zip(self._joint_ids, joints, strict=True):
            pybullet.resetJointState(self._body, joint, value, 0.0, physicsClientId=self._client)

    def positions(self) -> FloatArray:
        """Return the real joint positions, shape (n,)."""
        states = pybullet.getJointStates(self._body, self._joint_ids, physicsClientId=self._client)
        return np.array([state[0] for state in states])
