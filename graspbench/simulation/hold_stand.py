"""A stand that tries grasps: a hand on a floating wrist, one object in it, forces and motions on demand.

The palm at the grasp is the origin of the stand, so that hand and object are loaded once for all grasps of a
set. There is no gravity; where a trial wants weight, it is a force on the object alone, since fingers have
motors that carry them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Self

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation, Slerp

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.hand.hand_pose import HandPose
from graspbench.hand.model import HandModel
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.slip import SlipMeter
from graspbench.simulation.stage import turn_deg
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import ObjectWorld

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

GRAVITY_M_S2 = 9.81
_CONTACT_BREAKING_M = 0.002
_CONTACT_FORCE_N = 0.05
_LOOK_S = 0.01
_REST_S, _REST_M, _REST_DEG = 0.15, 1e-4, 0.1
_FAR_M = 100.0


@dataclass(frozen=True)
class StandParameters:
    """The physics in which grasps are tried."""

    time_step_s: Annotated[float, Field(gt=0, le=0.005, description="Physics time step, s")] = 0.002
    solver_iterations: Annotated[
        int, Field(ge=10, le=1000, description="Constraint solver iterations a step")
    ] = 40
    stiffness_nm_rad: Annotated[
        float, Field(gt=0, description="Stiffness with which joints go to the squeeze, N m/rad")
    ] = 10.0
    damping_nms_rad: Annotated[float, Field(gt=0, description="Damping of the joints, N m s/rad")] = 0.2
    torsional_friction_m: Annotated[
        float, Field(ge=0, description="Torque about a contact's normal per normal force, m")
    ] = 0.002
    closing_time_s: Annotated[
        float,
        Field(gt=0, description="Time from the pregrasp to the grasp, and from there to the squeeze, s"),
    ] = 0.25
    settling_time_s: Annotated[float, Field(ge=0, description="Time at the squeeze before a trial, s")] = 0.15


@dataclass(frozen=True)
class Drift:
    """How far an object has come from where it was held.

    Attributes:
        moved_m: Way of its centre in the palm frame.
        turned_deg: Its rotation in the palm frame.
        slip_m: Net sliding at the contact that slid farthest.
        fingers: Fingers that touch it.
    """

    moved_m: float
    turned_deg: float
    slip_m: float
    fingers: int


Goes = Callable[[float], FloatArray]
"""Pose of the palm in the stand, shape (4, 4), for the share of a motion's time that has gone by."""


class HoldStand:
    """A hand and an object, for one grasp after the other; use it as a context manager.

    Args:
        hand: The hand.
        object_model: The object.
        parameters: The physics.

    Attributes:
        friction: Coulomb friction between hand and object in the present trial.
        mass_kg: The object's mass in the present trial.

    Raises:
        HandError: PyBullet cannot load the hand.
        SimulationError: PyBullet cannot build the object.
    """

    def __init__(
        self, hand: HandModel, object_model: "ObjectModel", parameters: StandParameters | None = None
    ) -> None:
        self.hand, self.object_model = hand, object_model
        self.parameters = StandParameters() if parameters is None else parameters
        self.friction, self.mass_kg = object_model.friction, object_model.mass_kg
        far = np.eye(4)
        far[2, 3] = _FAR_M
        self._world = ObjectWorld(object_model, far)
        try:
            self._client = self._world.client
            pybullet.setPhysicsEngineParameter(
                contactBreakingThreshold=_CONTACT_BREAKING_M,
                fixedTimeStep=self.parameters.time_step_s,
                numSolverIterations=self.parameters.solver_iterations,
                physicsClientId=self._client,
            )
            self._wrist = FloatingWrist(hand, np.eye(4), np.array([0.0, 0.0, 1.0]))
            friction = TipFriction(self.friction, self.parameters.torsional_friction_m, self.friction)
            self._fingers = SimulatedHand(self._world, hand, self._wrist, hand.rest, friction)
        except BaseException:
            self.close()
            raise
        self._all = np.arange(hand.n_joints)
        self._start = np.eye(4)
        self._squeezed = self._rest = hand.rest
        self._palm = np.eye(4)
        self._slip: SlipMeter | None = None
        self._saved = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the world; closing twice does no harm."""
        self._world.close()

    @property
    def weight_n(self) -> float:
        """The object's weight in the present trial."""
        return self.mass_kg * GRAVITY_M_S2

    def grasp(
        self,
        stages: Sequence[HandPose],
        mass_kg: float,
        friction: float,
        *,
        transform_error: FloatArray | None = None,
    ) -> Drift:
        """Let the hand close from the first stage by the others, and remember the state for `restore`.

        The object floats without weight.

        Args:
            stages: Open, touching, squeezed.
            mass_kg: The object's mass.
            friction: Coulomb friction between hand and object.
            transform_error: How the object is displaced in its own frame, shape (4, 4); None: not at all.

        Returns:
            How far the closing moved the object; what comes later is measured from after it.
        """
        self._set_object(mass_kg, friction)
        self._slip = None
        at_grasp = stages[len(stages) // 2].transform_palm_to_object
        object_to_stand = np.asarray(np.linalg.inv(at_grasp), dtype=np.float64)
        placed = object_to_stand if transform_error is None else object_to_stand @ transform_error
        palms = [object_to_stand @ stage.transform_palm_to_object for stage in stages]
        nothing = np.zeros(3)
        self._world.put_object(placed)
        self._wrist.put(palms[0])
        self._fingers.put(stages[0].joints)
        steps = self._steps(self.parameters.closing_time_s)
        for k in range(1, len(stages)):
            way = _between(palms[k - 1], palms[k])
            for i in range(1, steps + 1):
                share = i / steps
                joints = (1.0 - share) * stages[k - 1].joints + share * stages[k].joints
                # What presses beyond the contacts is a torque; springs hold the posture that touches.
                self._rest = stages[k - 1].joints if k == len(stages) - 1 else joints
                self._step(way(share), joints, nothing, None)
        self._palm, self._squeezed = palms[-1], stages[-1].joints
        self._rest = self._fingers.state()[0]
        for _ in range(self._steps(self.parameters.settling_time_s)):
            self._step(self._palm, self._squeezed, nothing, None)
        self._rest = self._fingers.state()[0]
        self._start = placed_in(self._fingers.palm_pose(), placed)
        moved = self.drift()
        self._begin()
        if self._saved >= 0:
            pybullet.removeState(self._saved, physicsClientId=self._client)
        self._saved = pybullet.saveState(physicsClientId=self._client)
        return moved

    def restore(self) -> None:
        """Return to the state after the last `grasp`."""
        self._wrist.put(self._palm)  # so that its motors have no goal of a trial before
        pybullet.restoreState(stateId=self._saved, physicsClientId=self._client)
        self._begin()

    def hold(self, force_n: FloatArray, time_s: float, lost: Callable[[Drift], bool]) -> Drift:
        """Apply a constant force at the object's centre, stand frame, shape (3,).

        It ends when time is up or the object is lost, or before that when hand and object are at rest under
        the force: nothing would come after it.
        """
        drift = before = self.drift()
        rest = max(1, round(_REST_S / _LOOK_S))
        for k in range(1, self._steps(time_s) + 1):
            self._step(self._palm, self._squeezed, force_n, None)
            if k % self._look == 0:
                drift = self._looked()
                if lost(drift):
                    break
                if (k // self._look) % rest == 0:
                    moved = abs(drift.moved_m - before.moved_m)
                    if moved < _REST_M and abs(drift.turned_deg - before.turned_deg) < _REST_DEG:
                        break
                    before = drift
        return drift

    def move(self, goes: Goes, force_n: FloatArray, time_s: float, lost: Callable[[Drift], bool]) -> Drift:
        """Carry the object along a motion of the palm, with a force on it; as `hold`."""
        steps, drift = self._steps(time_s), self.drift()
        for k in range(1, steps + 1):
            self._step(goes(k / steps), self._squeezed, force_n, None)
            if k % self._look == 0:
                drift = self._looked()
                if lost(drift):
                    break
        return drift

    def ramp(
        self,
        force_n: FloatArray,
        torque_nm: FloatArray,
        time_s: float,
        lost: Callable[[Drift], bool],
        *,
        force_kept_n: FloatArray | None = None,
        palm: FloatArray | None = None,
    ) -> float:
        """Let force and torque grow from nothing; return the share at which it was still held, 0 to 1.

        Args:
            force_n: At the end, at the object's centre, stand frame, shape (3,).
            torque_nm: At the end, shape (3,).
            time_s: How long they grow.
            lost: What ends it.
            force_kept_n: A force that is there all the time, shape (3,).
            palm: Where the palm stays, shape (4, 4); None: where it closed.
        """
        steps, resisted = self._steps(time_s), 0.0
        kept = np.zeros(3) if force_kept_n is None else force_kept_n
        stays = self._palm if palm is None else palm
        for k in range(1, steps + 1):
            share = k / steps
            self._step(stays, self._squeezed, kept + share * force_n, share * torque_nm)
            if k % self._look == 0 or k == steps:
                if lost(self._looked()):
                    break
                resisted = share
        return resisted

    def drift(self) -> Drift:
        """Return how far the object is from where it was when the hand had closed."""
        now = self.object_in_palm()
        touches = sum(touch is not None for touch in self._fingers.touches(_CONTACT_FORCE_N))
        slip = 0.0 if self._slip is None else self._slip.slip_m
        moved = float(np.linalg.norm(now[:3, 3] - self._start[:3, 3]))
        return Drift(moved, turn_deg(self._start, now), slip, touches)

    def object_in_palm(self) -> FloatArray:
        """Return transform_object_to_palm, shape (4, 4)."""
        return placed_in(self._fingers.palm_pose(), self.object_pose())

    def object_pose(self) -> FloatArray:
        """Return the object's pose in the stand, shape (4, 4)."""
        pose = self._world.object_pose()
        if not np.isfinite(pose).all():
            raise SimulationError("the object's pose is not finite", remedy="reduce stand.time_step_s")
        return pose

    @property
    def palm(self) -> FloatArray:
        """Where the palm is wanted after the closing, stand frame, shape (4, 4)."""
        return self._palm.copy()

    @property
    def _look(self) -> int:
        return max(1, round(_LOOK_S / self.parameters.time_step_s))

    def _steps(self, time_s: float) -> int:
        return max(1, round(time_s / self.parameters.time_step_s))

    def _begin(self) -> None:
        self._start = self.object_in_palm()
        self._slip = SlipMeter(self._fingers, tuple(range(self.hand.n_fingers)), _CONTACT_FORCE_N)
        self._slip.look()

    def _looked(self) -> Drift:
        if self._slip is not None:
            self._slip.look()
        return self.drift()

    def _step(
        self, palm: FloatArray, joints: FloatArray, force_n: FloatArray, torque_nm: FloatArray | None
    ) -> None:
        p = self.parameters
        self._fingers.drive_wrist(palm, p.time_step_s)
        q, velocity = self._fingers.state()
        # In all the torque of springs to the goal; the part that does not change is none of the solver's.
        pressing = p.stiffness_nm_rad * (joints - self._rest)
        away = self._rest - q
        springs = p.stiffness_nm_rad * away - p.damping_nms_rad * velocity
        rate = p.stiffness_nm_rad / p.damping_nms_rad
        self._fingers.drive_compliantly(pressing, springs, rate * away, self._all)
        if np.any(force_n):
            position, _ = pybullet.getBasePositionAndOrientation(
                self._world.object_id, physicsClientId=self._client
            )
            pybullet.applyExternalForce(
                self._world.object_id,
                -1,
                force_n.tolist(),
                position,
                pybullet.WORLD_FRAME,
                physicsClientId=self._client,
            )
        if torque_nm is not None and np.any(torque_nm):
            pybullet.applyExternalTorque(
                self._world.object_id,
                -1,
                torque_nm.tolist(),
                pybullet.WORLD_FRAME,
                physicsClientId=self._client,
            )
        pybullet.stepSimulation(physicsClientId=self._client)

    def _set_object(self, mass_kg: float, friction: float) -> None:
        self.mass_kg, self.friction = mass_kg, friction
        moments = np.linalg.eigvalsh(self.object_model.inertia) * (mass_kg / self.object_model.mass_kg)
        pybullet.changeDynamics(
            self._world.object_id,
            -1,
            mass=mass_kg,
            localInertiaDiagonal=moments.tolist(),
            lateralFriction=1.0,
            rollingFriction=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=self._client,
        )
        # Bullet multiplies the two bodies' coefficients.
        for link in range(-1, pybullet.getNumJoints(self._fingers.body, physicsClientId=self._client)):
            pybullet.changeDynamics(
                self._fingers.body, link, lateralFriction=friction, physicsClientId=self._client
            )


def placed_in(transform_palm: FloatArray, transform_object: FloatArray) -> FloatArray:
    """Return the pose of the object in the palm frame, shape (4, 4)."""
    pose: FloatArray = np.linalg.inv(transform_palm) @ transform_object
    return pose


def _between(before: FloatArray, after: FloatArray) -> Goes:
    """Return the motion along a line from one pose to another."""
    if np.abs(before - after).max() < 1e-12:
        return lambda _: after
    turn = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack((before[:3, :3], after[:3, :3]))))

    def goes(share: float) -> FloatArray:
        pose = np.eye(4)
        pose[:3, :3] = turn(share).as_matrix()
        pose[:3, 3] = (1.0 - share) * before[:3, 3] + share * after[:3, 3]
        return pose

    return goes
