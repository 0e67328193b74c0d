"""Does the grasp hold? Squeeze, lift, hold, tilt the wrist, and push until the object slips.

The fingers are controlled by torques: each fingertip applies its share of the internal grip force and of the
object's weight, and every joint is a soft spring around where it gripped (joint impedance).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio
import pybullet
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.simulation.execute import Stage, tilt_axis, turn_deg
from graspbench.simulation.execution import PhaseOutcome
from graspbench.simulation.grip import grip_forces
from graspbench.simulation.hand import Touch

_RENEW_S = 0.01
_PUSHES = np.vstack((np.eye(3), -np.eye(3)))[[0, 3, 1, 4, 2, 5]]


@dataclass(frozen=True)
class HoldOutcome:
    """What came of the phases after the contact.

    Attributes:
        grip_force_n: Mean normal force of a finger.
        phases: Their outcomes, up to the first that lost the object.
        pushes_weight: Largest push resisted along +-x, +-y, +-z, multiples of the weight; None if not tried.
        reason: Why the object was lost; None if it was not.
    """

    grip_force_n: float
    phases: tuple[PhaseOutcome, ...]
    pushes_weight: tuple[float, ...] | None
    reason: str | None


def hold_and_push(stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> HoldOutcome:
    """Squeeze, lift, hold, tilt and hold again; then push, if asked for.

    Args:
        stage: Hand and object, all fingers in touch.
        fingers: The fingers that touch.
        touches: How each of them touched first.
    """
    p = stage.parameters
    grip = _Grip(stage, fingers, touches)
    if not grip.squeeze():
        return HoldOutcome(grip.mean_force_n, tuple(grip.phases), None, grip.reason)
    low = stage.hand.palm_pose()
    high = low.copy()
    high[2, 3] += p.lift_height_m
    pivot = stage.world.object_pose()[:3, 3] + [0.0, 0.0, p.lift_height_m]
    axis = tilt_axis(low)

    def lifted(share: float) -> FloatArray:
        pose = low.copy()
        pose[2, 3] += share * p.lift_height_m
        return pose

    def tilted(share: float) -> FloatArray:
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(np.radians(p.rotation_deg) * share * axis).as_matrix()
        turn[:3, 3] = pivot - turn[:3, :3] @ pivot
        pose: FloatArray = turn @ high
        return pose

    phases = [("lift", lifted, p.lift_time_s), ("hold", lambda _: high, p.hold_time_s)]
    if p.rotation_deg > 0:
        phases += [
            ("rotate", tilted, p.rotation_time_s),
            ("hold_rotated", lambda _: tilted(1.0), p.hold_time_s),
        ]
    for name, motion, time_s in phases:
        if not grip.move(name, motion, time_s):
            return HoldOutcome(grip.mean_force_n, tuple(grip.phases), None, grip.reason)
    pushes = tuple(grip.push(direction) for direction in _PUSHES) if p.until == "pushes" else None
    return HoldOutcome(grip.mean_force_n, tuple(grip.phases), pushes, None)


class _Grip:
    """The fingers' force control, and what becomes of the object in it."""

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        self._stage, self._fingers, self._model = stage, fingers, stage.model
        self._object = stage.world.object_model
        self._gravity = stage.world.scene.gravity
        self._weight_n = self._object.mass_kg * self._gravity
        self._pinocchio = self._model.model.copy()
        self._data = self._pinocchio.createData()
        self._felt = list(touches)
        self._age = 0
        self._renew = max(1, round(_RENEW_S / stage.time_step_s))
        self._rest = stage.hand.state()[0]
        self._forces = np.zeros((len(fingers), 3))
        self._sharing = np.zeros((len(fingers), 3, 3))
        self._update_model(self._rest, stage.hand.palm_pose())
        self._ground = stage.world.object_pose()[2, 3]
        self._reference = np.eye(4)
        self.mean_force_n = self._needed_force()
        self.phases: list[PhaseOutcome] = []
        self.reason: str | None = None

    def squeeze(self) -> bool:
        """Build the grip force up, then take the object's weight; return whether all went well."""
        stage = self._stage
        steps = max(1, round(stage.parameters.squeeze_time_s / stage.time_step_s))
        palm = stage.hand.palm_pose()
        stage.hand.release_motors()
        for k in range(steps):
            if k % max(1, steps // 4) == 0:
                self._distribute(palm)
            share = _smooth((k + 1) / steps)
            self._control(palm, share, 0.0)
            stage.step()
        self._distribute(palm)
        self._rest = stage.hand.state()[0]
        for k in range(steps // 2):
            self._control(palm, 1.0, _smooth((k + 1) / (steps // 2)))
            stage.step()
        self._reference = self._object_in_palm()
        return self._judge("squeeze", lifted=False)

    def move(self, name: str, motion: Callable[[float], FloatArray], time_s: float) -> bool:
        """Carry the object along a motion of the palm; return whether it was held."""
        stage = self._stage
        steps = max(1, round(time_s / stage.time_step_s))
        for k in range(steps):
            palm = motion(_smooth((k + 1) / steps))
            self._control(palm, 1.0, 1.0)
            stage.step()
        return self._judge(name, lifted=True)

    def push(self, direction: FloatArray) -> float:
        """Push harder and harder until the object slips; return the push resisted, in weights."""
        stage, p = self._stage, self._stage.parameters
        client = stage.world.client
        saved = pybullet.saveState(physicsClientId=client)
        before, palm = self._object_in_palm(), stage.hand.palm_pose()
        steps = max(1, round(p.push_time_s / stage.time_step_s))
        resisted = 0.0
        for k in range(steps):
            push = p.push_limit * (k + 1) / steps
            force = push * self._weight_n * direction
            pybullet.applyExternalForce(
                stage.world.object_id,
                -1,
                force.tolist(),
                stage.world.object_pose()[:3, 3].tolist(),
                pybullet.WORLD_FRAME,
                physicsClientId=client,
            )
            self._control(palm, 1.0, 1.0)
            pybullet.stepSimulation(physicsClientId=client)
            if np.linalg.norm(self._object_in_palm()[:3, 3] - before[:3, 3]) > p.slip_limit_m:
                break
            resisted = push
        pybullet.restoreState(stateId=saved, physicsClientId=client)
        pybullet.removeState(saved, physicsClientId=client)
        return float(resisted)

    def _needed_force(self) -> float:
        p = self._stage.parameters
        carrying = self._weight_n / (p.friction * len(self._fingers))
        return float(max(p.grip_force_n, p.grip_safety * carrying))

    def _distribute(self, palm: FloatArray) -> None:
        """Distribute grip force and weight over the contacts as they are felt now (palm frame)."""
        # A finger that has lost touch for a moment is taken to be where it was.
        self._felt = [new or old for new, old in zip(self._touches(), self._felt, strict=True)]
        felt = self._felt
        rotation = palm[:3, :3]
        points = (np.stack([t.point for t in felt]) - palm[:3, 3]) @ rotation
        normals = np.stack([t.normal for t in felt]) @ rotation
        forces, _ = grip_forces(points, normals, self._stage.parameters.friction, self.mean_force_n)
        self._forces = forces
        centre = self._object_in_palm()[:3, 3]
        arms = points - centre
        grasp_map: FloatArray = np.zeros((6, 3 * len(felt)))
        for i, arm in enumerate(arms):
            grasp_map[:3, 3 * i : 3 * i + 3] = np.eye(3)
            grasp_map[3:, 3 * i : 3 * i + 3] = 10.0 * _cross(arm)
        inverse = np.linalg.pinv(grasp_map, rcond=1e-3)
        self._sharing = np.asarray(inverse[:, :3].reshape(len(felt), 3, 3), dtype=np.float64)

    def _control(self, palm: FloatArray, grip: float, load: float) -> None:
        """Set wrist and torques for the next step."""
        stage = self._stage
        stage.hand.drive_wrist(palm, stage.time_step_s)
        q, velocity = stage.hand.state()
        if self._age % self._renew == 0:
            self._update_model(q, palm)
        self._age += 1
        forces = grip * self._forces + load * self._weight_n * self._upward
        stage.hand.apply_torques(
            self._jacobians_t @ forces.ravel() + self._holding + self._spring_torques(q, velocity)
        )

    def _update_model(self, q: FloatArray, palm: FloatArray) -> None:
        """Compute what depends on the posture, which hardly changes within `_RENEW_S`."""
        dt, p = self._stage.time_step_s, self._stage.parameters
        self._upward = self._sharing @ palm[2, :3]
        self._jacobians_t = self._model.tip_jacobians(q)[list(self._fingers)].reshape(-1, len(q)).T
        rotation = palm[:3, :3] @ self._model.transform_palm_to_root[:3, :3].T
        self._pinocchio.gravity.linear = rotation.T @ np.array([0.0, 0.0, -self._gravity])
        self._holding = np.asarray(pinocchio.computeGeneralizedGravity(self._pinocchio, self._data, q))
        upper = np.triu(pinocchio.crba(self._pinocchio, self._data, q))
        ahead = dt * p.damping_nms_rad + dt * dt * p.stiffness_nm_rad
        inertia = upper + np.triu(upper, 1).T + ahead * np.eye(len(q))
        self._implicit = np.eye(len(q)) - ahead * np.linalg.inv(inertia)

    def _spring_torques(self, q: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the torques of springs and dampers, taken at the end of the next step.

        Light links make explicit dampers unstable at any useful gain (Tan, Liu and Turk 2011).
        """
        dt, p = self._stage.time_step_s, self._stage.parameters
        explicit = p.stiffness_nm_rad * (self._rest - q - dt * velocity) - p.damping_nms_rad * velocity
        torques: FloatArray = self._implicit @ explicit
        return torques

    def _touches(self) -> list[Touch | None]:
        touches = self._stage.hand.touches(self._stage.parameters.contact_force_n)
        return [touches[f] for f in self._fingers]

    def _object_in_palm(self) -> FloatArray:
        pose: FloatArray = np.linalg.inv(self._stage.hand.palm_pose()) @ self._stage.world.object_pose()
        return pose

    def _judge(self, name: str, *, lifted: bool) -> bool:
        now = self._object_in_palm()
        contacts = sum(touch is not None for touch in self._touches())
        slip = float(np.linalg.norm(now[:3, 3] - self._reference[:3, 3]))
        height = self._stage.world.object_pose()[2, 3] - self._ground
        p = self._stage.parameters
        if lifted and height < 0.5 * p.lift_height_m:
            self.reason = f"the object was dropped in phase {name}"
        elif contacts < 2:
            self.reason = f"only {contacts} finger(s) held on in phase {name}"
        elif slip > p.slip_limit_m:
            self.reason = f"the object slipped {1e3 * slip:.0f} mm in phase {name}"
        held = self.reason is None
        self.phases.append(PhaseOutcome(name, contacts, slip, turn_deg(self._reference, now), held))
        return held


def _smooth(share: float) -> float:
    """Return a fifth-order step from 0 to 1 that starts and ends at rest."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def _cross(v: FloatArray) -> FloatArray:
    """Return the matrix of the cross product with a vector, shape (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
