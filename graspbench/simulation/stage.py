"""World and hand while a grasp is executed."""

from copy import copy
from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.hand.model import HandModel
from graspbench.simulation.arm_parameters import FLOATING
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.execution_result import Motion
from graspbench.simulation.mounts.choice import Carrier, make_mount
from graspbench.simulation.mounts.mount import PalmTask
from graspbench.simulation.phases import PhasePlan, PhasePlanner, palm_task, plan_phases
from graspbench.simulation.ride import Ride
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import World

_SAMPLE_S = 0.02
_CONTACT_BREAKING_M = 0.002
_FREE_ITERATIONS = 15
_HALT_S = 0.5
_NO_CORRECTION: FloatArray | None = None
_CLOSING_S = 0.25
"""About the time from the end of the path to the last touch."""


class JointPath(Protocol):
    """What is executed: a path of palm and joints, its last sample on the planned contacts."""

    @property
    def times(self) -> FloatArray:
        """Ascending times from 0, shape (t,)."""
        ...

    @property
    def joints(self) -> FloatArray:
        """Joint positions, shape (t, n_q)."""
        ...

    @property
    def transform_palm_to_world(self) -> FloatArray:
        """Poses of the palm, shape (t, 4, 4)."""
        ...


class Stage:
    """World and hand while a grasp is executed; it steps time and takes samples.

    Args:
        world: The object at rest on the table.
        hand: The hand.
        path: The planned motion up to the grasp.
        parameters: How to execute.
        friction: Between fingertips and object.
        plan: What follows the contact; the mount is placed so that it can do all of it.
        ride: How the object moves, as far as the hand knows; None for one at rest. Poses are planned where
            the object was at the ride's reference, and carried along when they are driven.
        carrier: What carries the hand.

    Attributes:
        steps: Time steps gone by.
        palm_error_max_m: Largest distance, at any sample, of the palm from where it was wanted.
    """

    def __init__(
        self,
        world: World,
        hand: HandModel,
        path: JointPath,
        parameters: ExecutionParameters,
        friction: TipFriction,
        plan: PhasePlanner = plan_phases,
        ride: Ride | None = None,
        carrier: Carrier = FLOATING,
    ) -> None:
        self._ride, self._correction = ride, _NO_CORRECTION
        self.world, self.model, self.parameters, self.friction = world, hand, parameters, friction
        self.time_step_s = parameters.time_step_s
        self.steps = 0
        self.palm_error_max_m = 0.0
        self._samples: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []
        self._sampled_step = 0
        pybullet.setPhysicsEngineParameter(
            contactBreakingThreshold=_CONTACT_BREAKING_M, physicsClientId=world.client
        )
        self._plan = plan
        task = palm_task(
            path.times, path.transform_palm_to_world, self.object_pose()[:3, 3], parameters, plan
        )
        if ride is not None:
            task = _carried_task(task, ride, float(path.times[-1]), parameters)
        mount = make_mount(carrier, hand, task)
        self._iterations = max(parameters.solver_iterations, mount.solver_iterations)
        self._set_steps(1, self._iterations)
        self.hand = SimulatedHand(world, hand, mount, path.joints[0], friction)

    def phases(self) -> PhasePlan:
        """Plan what follows the contact from where palm and object are now."""
        position = self.object_pose()[:3, 3]
        return self._plan(self.palm_pose(), position, self.parameters, self.hand.mount.tilt_direction)

    def carried(self, planned: FloatArray, ahead_s: float = 0.0) -> FloatArray:
        """Return where a planned pose, shape (4, 4), is in the world now or in a moment."""
        if self._correction is not None:
            planned = self._correction @ planned
        return planned if self._ride is None else self._ride.displacement(self.time_s + ahead_s) @ planned

    def as_planned(self, pose: FloatArray) -> FloatArray:
        """Return a pose in the world now, shape (4, 4), as seen from where things are planned."""
        if self._ride is not None:
            pose = np.linalg.inv(self._ride.displacement(self.time_s)) @ pose
        return pose if self._correction is None else np.linalg.inv(self._correction) @ pose

    def correct(self, transform: FloatArray) -> None:
        """Take all that is planned to be elsewhere from now on, shape (4, 4): so was the object found."""
        self._correction = transform

    def object_pose(self) -> FloatArray:
        """Return the object's pose as seen from where things are planned, shape (4, 4)."""
        return self.as_planned(self.world.object_pose())

    def palm_pose(self) -> FloatArray:
        """Return the palm's pose as seen from where things are planned, shape (4, 4)."""
        return self.as_planned(self.hand.palm_pose())

    def halt(self) -> None:
        """Let the hand, which has lifted a moving object, come to rest."""
        if self._ride is not None:
            self._ride.halt(self.time_s, _HALT_S)

    def step(self, count: int = 1) -> None:
        """Advance the simulation by some time steps at once.

        More than one is for a hand that touches nothing: its motors are the only constraints.
        """
        if count != self._count:
            self._set_steps(count, _FREE_ITERATIONS if count > 1 else self._iterations)
        self.world.carry(count * self.time_step_s)
        pybullet.stepSimulation(physicsClientId=self.world.client)
        self.steps += count
        if (self.steps - self._sampled_step) * self.time_step_s >= _SAMPLE_S * (1.0 - 1e-9):
            self.sample()

    def sample(self) -> None:
        """Keep a sample for the record."""
        if self._samples and self._sampled_step == self.steps:
            return
        self._sampled_step = self.steps
        pose = self.world.object_pose()
        if not np.isfinite(pose).all():
            raise SimulationError("the object's pose is not finite", remedy="reduce execution.time_step_s")
        palm = self.hand.palm_pose()
        error = float(np.linalg.norm(palm[:3, 3] - self.hand.palm_goal[:3, 3]))
        self.palm_error_max_m = max(self.palm_error_max_m, error)
        self._samples.append((self.time_s, self.hand.state()[0], palm, pose))

    def _set_steps(self, count: int, iterations: int) -> None:
        self._count = count
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=count * self.time_step_s,
            numSolverIterations=iterations,
            physicsClientId=self.world.client,
        )

    @property
    def time_s(self) -> float:
        """Simulated time since the start."""
        return self.steps * self.time_step_s

    def motion(self) -> Motion:
        """Return the samples taken."""
        times, joints, palms, objects = zip(*self._samples, strict=True)
        return Motion(np.array(times), np.stack(joints), np.stack(palms), np.stack(objects))


def _carried_task(task: PalmTask, ride: Ride, path_s: float, p: ExecutionParameters) -> PalmTask:
    """Return a mount's task as the ride will carry it, with about the times that the phases take."""
    halted = copy(ride)
    lifted_s = path_s + _CLOSING_S + 1.5 * p.squeeze_time_s + p.lift_time_s
    halted.halt(lifted_s, _HALT_S)
    grasped, last = halted.displacements(np.array([path_s + _CLOSING_S, lifted_s + _HALT_S]))
    poses = {}
    for direction, (palms, times_s) in task.poses.items():
        later = np.where(times_s > path_s, times_s + _CLOSING_S + 1.5 * p.squeeze_time_s, times_s)
        poses[direction] = halted.displacements(later) @ palms, later
    position = grasped[:3, :3] @ task.object_position + grasped[:3, 3]
    return PalmTask(grasped @ task.grasping, position, last[:3, :3] @ task.tilt_axis, poses)


def turn_deg(before: FloatArray, after: FloatArray) -> float:
    """Return the angle between the orientations of two poses, shape (4, 4)."""
    cosine = 0.5 * (np.trace(before[:3, :3].T @ after[:3, :3]) - 1.0)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
