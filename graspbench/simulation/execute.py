"""A planned grasp played in the physics simulation: approach, closing, and what `lift` adds."""

from typing import Protocol

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation, Slerp

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.simulation.execution import ExecutionParameters, ExecutionResult, Motion
from graspbench.simulation.hand import SimulatedHand, Touch
from graspbench.simulation.world import World
from graspbench.simulation.wrist import FloatingWrist

_SAMPLE_S = 0.02


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
    """World and hand while a grasp is executed; it steps time and takes samples."""

    def __init__(
        self, world: World, hand: HandModel, path: JointPath, parameters: ExecutionParameters
    ) -> None:
        self.world, self.model, self.parameters = world, hand, parameters
        self.time_step_s = parameters.time_step_s
        self.steps = 0
        self._samples: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self.time_step_s,
            numSolverIterations=parameters.solver_iterations,
            contactBreakingThreshold=0.002,
            physicsClientId=world.client,
        )
        palms = path.transform_palm_to_world
        wrist = FloatingWrist(hand, palms[0], tilt_axis(palms[-1]))
        self.hand = SimulatedHand(world, hand, wrist, path.joints[0], parameters)

    def step(self) -> None:
        """Advance the simulation by one time step."""
        pybullet.stepSimulation(physicsClientId=self.world.client)
        self.steps += 1
        if self.steps % max(1, round(_SAMPLE_S / self.time_step_s)) == 0:
            self.sample()

    def sample(self) -> None:
        """Keep a sample for the record."""
        if self._samples and self._samples[-1][0] == self.time_s:
            return
        pose = self.world.object_pose()
        if not np.isfinite(pose).all():
            raise SimulationError("the object's pose is not finite", remedy="reduce execution.time_step_s")
        self._samples.append((self.time_s, self.hand.state()[0], self.hand.palm_pose(), pose))

    @property
    def time_s(self) -> float:
        """Simulated time since the start."""
        return self.steps * self.time_step_s

    def motion(self) -> Motion:
        """Return the samples taken."""
        times, joints, palms, objects = zip(*self._samples, strict=True)
        return Motion(np.array(times), np.stack(joints), np.stack(palms), np.stack(objects))


def tilt_axis(transform_palm_to_world: FloatArray) -> FloatArray:
    """Return the horizontal direction, shape (3,), about which the wrist is tilted in the rotation phase."""
    approach = transform_palm_to_world[:3, 2]
    axis = np.cross(approach, [0.0, 0.0, 1.0])
    if np.linalg.norm(axis) < 0.1:  # straight down: any horizontal axis of the palm will do
        axis = transform_palm_to_world[:3, 0] * [1.0, 1.0, 0.0]
    unit: FloatArray = axis / np.linalg.norm(axis)
    return unit


def execute(
    world: World, hand: HandModel, grasp: Grasp, path: JointPath, parameters: ExecutionParameters
) -> ExecutionResult:
    """Execute a planned grasp on the object in the world.

    The hand follows the path by position control. A finger that touches stops; after the path's end
    the others go on along the contact's normal. With ``until`` beyond "contact" the fingers then squeeze,
    lift and so on (`graspbench.simulation.lift`).

    Args:
        world: The object at rest on the table; it is changed by the execution.
        hand: The hand.
        grasp: The planned grasp; its posture tells which finger goes to which contact.
        path: The planned motion.
        parameters: How to execute.

    Raises:
        SimulationError: The simulation diverged.
        HandError: PyBullet cannot load the hand.
    """
    from graspbench.simulation.lift import hold_and_push  # needs this module's Stage

    stage = Stage(world, hand, path, parameters)
    start = world.object_pose()
    fingers = grasp.posture.fingers if grasp.posture is not None else tuple(range(len(grasp.points)))
    closing = _Closing(stage, grasp, fingers)
    tip_error = closing.follow(path)
    closing.close()
    reached = world.object_pose()
    displacement = float(np.linalg.norm(reached[:3, 3] - start[:3, 3]))
    made = sum(np.isfinite(closing.contact_time_s[f]) for f in fingers)
    reason = None if made == len(fingers) else f"only {made} of {len(fingers)} fingers touched the object"
    outcome = None
    if reason is None and parameters.until in ("hold", "pushes"):
        outcome = hold_and_push(stage, fingers, [closing.touch[f] for f in fingers])
        reason = outcome.reason
    stage.sample()
    return ExecutionResult(
        success=reason is None,
        reason=reason,
        fingers=len(fingers),
        contacts_made=int(made),
        contact_time_s=tuple(float(closing.contact_time_s[f]) for f in fingers),
        contact_error_m=tuple(
            float(np.linalg.norm(closing.touch[f].point - point)) if f in closing.touch else np.nan
            for f, point in zip(fingers, grasp.points, strict=True)
        ),
        tip_error_max_m=tip_error,
        object_displacement_m=displacement,
        object_turn_deg=turn_deg(start, reached),
        grip_force_n=0.0 if outcome is None else outcome.grip_force_n,
        phases=() if outcome is None else outcome.phases,
        pushes_weight=None if outcome is None else outcome.pushes_weight,
        time_s=stage.time_s,
        motion=stage.motion(),
    )


def turn_deg(before: FloatArray, after: FloatArray) -> float:
    """Return the angle between the orientations of two poses, shape (4, 4)."""
    cosine = 0.5 * (np.trace(before[:3, :3].T @ after[:3, :3]) - 1.0)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


class _Closing:
    """The approach up to the touch of every finger."""

    def __init__(self, stage: Stage, grasp: Grasp, fingers: tuple[int, ...]) -> None:
        self._stage, self._model = stage, stage.model
        self._grasp, self._fingers = grasp, fingers
        n = self._model.n_fingers
        self.contact_time_s = np.full(n, np.nan)
        self.touch: dict[int, Touch] = {}
        self._goal = np.empty(0)
        self._palm = np.eye(4)

    def follow(self, path: JointPath) -> float:
        """Play the path; return the largest distance of a free fingertip from it."""
        stage, dt = self._stage, self._stage.time_step_s
        times = np.asarray(path.times)
        steps = max(1, round(float(times[-1]) / dt))
        at = np.arange(steps + 1, dtype=np.float64) * dt
        wanted = _resampled(at, times, path.joints)
        palms = _resampled_poses(at, times, path.transform_palm_to_world)
        self._goal = wanted[0].copy()
        worst = 0.0
        stage.sample()
        for k in range(1, steps + 1):
            self._palm = palms[k]
            stage.hand.drive_wrist(self._palm, dt)
            self._drive(wanted[k])
            stage.step()
            self._feel()
            if k % 10 == 0:
                worst = max(worst, self._tip_error(wanted[k]))
        return worst

    def close(self) -> None:
        """Move the fingers that do not touch yet on along their contacts' normals."""
        stage, p = self._stage, self._stage.parameters
        steps = int(np.ceil(p.closing_distance_m / (p.closing_speed_m_s * stage.time_step_s)))
        rotation = self._palm[:3, :3]
        for _ in range(steps):
            free = [i for i, f in enumerate(self._fingers) if np.isnan(self.contact_time_s[f])]
            if not free:
                break
            wanted = self._goal.copy()
            jacobians = self._model.tip_jacobians(self._goal)
            for i in free:
                index = self._model.finger_joints(self._fingers[i])
                jacobian = jacobians[self._fingers[i]][:, index]
                inward = -p.closing_speed_m_s * (rotation.T @ self._grasp.normals[i])
                damped = jacobian @ jacobian.T + 1e-6 * np.eye(3)
                wanted[index] += stage.time_step_s * (jacobian.T @ np.linalg.solve(damped, inward))
            self._drive(np.clip(wanted, self._model.lower, self._model.upper))
            stage.hand.drive_wrist(self._palm, stage.time_step_s)
            stage.step()
            self._feel()

    def _drive(self, wanted: FloatArray) -> None:
        """Move the goal of free fingers; the others stay where they touched."""
        goal = wanted.copy()
        for f in self._fingers:
            if np.isfinite(self.contact_time_s[f]):
                index = self._model.finger_joints(f)
                goal[index] = self._goal[index]
        velocity = (goal - self._goal) / self._stage.time_step_s
        self._goal = goal
        self._stage.hand.drive_joints(goal, velocity)

    def _feel(self) -> None:
        touches: tuple[Touch | None, ...] = self._stage.hand.touches(self._stage.parameters.contact_force_n)
        for f in self._fingers:
            touch = touches[f]
            if touch is not None and np.isnan(self.contact_time_s[f]):
                self.contact_time_s[f] = self._stage.time_s
                self.touch[f] = touch

    def _tip_error(self, wanted: FloatArray) -> float:
        free = [f for f in self._fingers if np.isnan(self.contact_time_s[f])]
        if not free:
            return 0.0
        palm = self._stage.hand.palm_pose()
        real = self._model.tip_positions(self._stage.hand.state()[0])[free]
        planned = self._model.tip_positions(wanted)[free]
        difference = _to_world(real, palm) - _to_world(planned, self._palm)
        return float(np.linalg.norm(difference, axis=1).max())


def _resampled_poses(at: FloatArray, times: FloatArray, poses: FloatArray) -> FloatArray:
    """Return poses between samples: positions linearly, orientations along great circles."""
    out = np.tile(np.eye(4), (len(at), 1, 1))
    out[:, :3, 3] = _resampled(at, times, poses[:, :3, 3])
    if len(times) > 1:
        slerp = Slerp(times, Rotation.from_matrix(poses[:, :3, :3]))
        out[:, :3, :3] = slerp(np.clip(at, times[0], times[-1])).as_matrix()
    else:
        out[:, :3, :3] = poses[0, :3, :3]
    return out


def _to_world(points: FloatArray, pose: FloatArray) -> FloatArray:
    moved: FloatArray = points @ pose[:3, :3].T + pose[:3, 3]
    return moved


def _resampled(at: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(at, times, values[:, k]) for k in range(values.shape[1])])
