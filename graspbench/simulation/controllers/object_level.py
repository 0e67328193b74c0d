"""What controllers of the object's own motion share: contacts as felt, feedback linearisation, forces."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.simulation.controllers.felt_contacts import FeltContacts
from graspbench.simulation.controllers.grasp_dynamics import GraspDynamics, GraspState
from graspbench.simulation.force_control import ForceControl
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch

_POSTURE_RATE = 10.0
"""How fast the fingers' free motion, which the object does not feel, goes to the posture at rest, 1/s."""


class ObjectLevelControl(ForceControl, ABC):
    """Joint torques by the object's pose, which is fed back; a subclass says how.

    Until the object is squeezed the fingers are springs, as in `ForceControl`; the subclass's law takes over
    when they carry the whole weight, and holds the object where it is then in the palm.

    Raises:
        HandError: A finger cannot move its contact in every direction by itself.
    """

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        super().__init__(stage, fingers, touches)
        if not stage.model.moves_tips_freely:
            raise HandError(
                f"the fingers of hand '{stage.model.name}' cannot move an object in every direction",
                remedy="set execution.control=joint_impedance",
            )
        self._dynamics = GraspDynamics(stage, fingers)
        self._dt = stage.time_step_s
        self._contacts_felt = FeltContacts(stage)
        self._goal: FloatArray | None = None
        self._last: _Step | None = None

    @abstractmethod
    def _torques(self, state: GraspState, step: "_Step", touches: Sequence[Touch]) -> FloatArray:
        """Return the joint torques for the next step, shape (n_q,).

        Args:
            state: The present state.
            step: Where the object shall be, and how fast, at its beginning and at its end.
            touches: Where each finger touches.
        """

    def aim(self, rest: FloatArray, object_in_palm: FloatArray) -> None:
        """Let the fingers' free motion go to a posture and the object to a pose in the palm."""
        self.rest, self._goal = rest, object_in_palm

    def displace(self, offset_m: FloatArray) -> None:
        """Move the object's goal at once, palm axes, shape (3,)."""
        assert self._goal is not None, "the object is held"
        goal = self._goal.copy()
        goal[:3, 3] += offset_m
        self._goal = goal
        if self._last is not None:  # a jump is no speed
            self._last = self._last.jumped(self._last.palm @ goal)

    def memory(self) -> Any:
        """Return what `recall` takes to return to the present."""
        return self._goal, self._last, self._contacts_felt.memory(), self.rest

    def recall(self, memory: Any) -> None:
        """Return to a time before."""
        self._goal, self._last, contacts, self.rest = memory
        self._contacts_felt.recall(contacts)

    def drive(self, palm: FloatArray, grip: float, load: float) -> None:
        """Set wrist and fingers for the next step; see `ForceControl.drive`."""
        if grip < 1.0 or load < 1.0:
            super().drive(palm, grip, load)
            return
        if self._goal is None:
            self._take_over()
        assert self._goal is not None
        stage = self._stage
        stage.hand.drive_wrist(palm, stage.time_step_s)
        self._pads.follow_load()
        step = _Step.after(self._last, palm, palm @ self._goal, self._dt)
        touches = self._contacts_felt.now(self.touches())
        state = self._dynamics.state(touches, step.palm_before, step.palm_twist, step.palm_acceleration)
        torques = self._torques(state, step, touches)
        stage.hand.drive_compliantly(torques, *self._springs(state), self._joints)
        self._last = step

    def _springs(self, state: GraspState) -> tuple[FloatArray, FloatArray]:
        """Return torques of springs in the joints and the velocities at which they vanish: there are none."""
        nothing = np.zeros_like(state.joints)
        return nothing, nothing

    def _take_over(self) -> None:
        self._goal = np.linalg.inv(self._stage.hand.palm_pose()) @ self._stage.world.object_pose()
        self.rest_here()
        self._contacts_felt.begin([new or old for new, old in zip(self.touches(), self._felt, strict=True)])

    def _forces_for(self, state: GraspState, wrench: FloatArray) -> FloatArray:
        """Return contact forces that grip the object and make a wrench on it, shape (3 n_c,)."""
        forces = (self._forces @ state.pose[:3, :3].T).ravel()
        # As contacts roll, the grip is in balance no more by itself.
        return forces + state.least_forces(wrench - state.grasp_map @ forces)


class LinearizedControl(ObjectLevelControl):
    """Feedback linearisation (thesis 2.3.1): torques that give the held object an acceleration.

    With contacts that stick, J q' = G^T v, the wanted acceleration of the object tells those of the joints,
    the inertia of the object tells the contact forces, and tau = M q'' + h + J^T f. The joints' accelerations
    lead to the velocities that fit the object's at the end of the time step, which takes in the change of
    the Jacobians.
    """

    @abstractmethod
    def _law(self, error: FloatArray, rate: FloatArray, state: GraspState) -> "Wanted":
        """Return how the object shall be accelerated beside its goal.

        Args:
            error: Of the pose from its goal, translation and rotation vector in world axes, shape (6,).
            rate: Of the twist, shape (6,).
            state: All else.
        """

    def _torques(self, state: GraspState, step: "_Step", touches: Sequence[Touch]) -> FloatArray:
        error = pose_difference(step.goal_before, state.pose)
        wanted = self._law(error, state.twist - step.twist_before, state)
        acceleration = (step.goal_twist - step.twist_before) / self._dt + wanted.acceleration
        wrench = state.inertia @ acceleration + state.gyroscopic - self._dynamics.gravity_wrench
        forces = self._forces_for(state, wrench - wanted.counted_on)
        self._commanded(state, acceleration)
        joints = self._joint_accelerations(state, state.twist + self._dt * acceleration)
        torques: FloatArray = state.mass_matrix @ joints + state.bias + state.contact_jacobian.T @ forces
        return torques

    def _commanded(self, state: GraspState, acceleration: FloatArray) -> None:
        """Take note of the acceleration that is asked for, shape (6,)."""

    def _joint_accelerations(self, state: GraspState, twist: FloatArray) -> FloatArray:
        """Return the accelerations after which the tips move with the object, shape (n_q,)."""
        inverse = state.joint_rates()
        wanted = inverse @ (state.grasp_map.T @ twist - state.palm_velocities)
        free = _POSTURE_RATE * (self.rest - state.joints)
        velocities = wanted + free - inverse @ (state.contact_jacobian @ free)
        return np.asarray((velocities - state.velocities) / self._dt)


class Wanted:
    """What a law asks for.

    Args:
        acceleration: Of the object beside its goal's, shape (6,).
        counted_on: Wrench that acts on the object without the fingers and the weight, shape (6,).
    """

    def __init__(self, acceleration: FloatArray, counted_on: FloatArray) -> None:
        self.acceleration, self.counted_on = acceleration, counted_on


class _Step:
    """Palm and goal at the beginning and at the end of a time step."""

    def __init__(
        self,
        palm_before: FloatArray,
        palm: FloatArray,
        goal_before: FloatArray,
        goal: FloatArray,
        twists: tuple[FloatArray, FloatArray, FloatArray],
        dt: float,
    ) -> None:
        self.palm_before, self.palm = palm_before, palm
        self.goal_before, self.goal = goal_before, goal
        self._dt = dt
        self.palm_twist_before, self.twist_before, self.palm_twist = twists
        self.goal_twist = pose_difference(goal_before, goal) / dt

    @classmethod
    def after(cls, last: "_Step | None", palm: FloatArray, goal: FloatArray, dt: float) -> "_Step":
        """Return the step to a palm and a goal from where the last one ended, or from rest there."""
        if last is None:
            rest = np.zeros(6)
            return cls(palm, palm, goal, goal, (rest, rest, rest), dt)
        twists = last.palm_twist, last.goal_twist, pose_difference(last.palm, palm) / dt
        return cls(last.palm, palm, last.goal, goal, twists, dt)

    def jumped(self, goal: FloatArray) -> "_Step":
        """Return the same step as if it had ended at another goal, at rest."""
        twists = self.palm_twist_before, self.twist_before, self.palm_twist
        return _Step(self.palm_before, self.palm, goal, goal, twists, self._dt)

    @property
    def palm_acceleration(self) -> FloatArray:
        """Of the palm's origin, shape (3,)."""
        return np.asarray((self.palm_twist[:3] - self.palm_twist_before[:3]) / self._dt)


def pose_difference(wanted: FloatArray, real: FloatArray) -> FloatArray:
    """Return translation and rotation vector from one pose to another, world axes, shape (6,)."""
    turn = Rotation.from_matrix(real[:3, :3] @ wanted[:3, :3].T).as_rotvec()
    return np.concatenate((real[:3, 3] - wanted[:3, 3], turn))
