"""The fingers' force control while they grip: grip force, weight, and soft springs around the posture."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pinocchio

from graspbench.arrays import BoolArray, FloatArray
from graspbench.grasp.internal_forces import ForceBalance
from graspbench.simulation.pad_friction import PadFriction
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch

_RENEW_S = 0.02
# Times what the weight needs: only objects lighter than that are gripped less than they are told.
_AMPLE = 4.0
# Of the friction that a poor grip leaves for the weight, at least so much is counted on.
_LEFT = 0.2
_EFFORT_ROUNDS = 4
_NEARLY_ALL = 0.98
_WEAKEST_N = 1e-3
_EFFORT_SHARE = 0.9
"""Of the torque limits, for grip, weight and the fingers' own weight; the rest is for the springs."""


class ForceControl:
    """Joint torques that press the fingertips on the object and hold the fingers' posture (joint impedance).

    The tips apply forces that grip the object and, once it is lifted, carry its weight: J' f, besides the
    fingers' own weight. The grip forces are fixed to the object, so that they stay in balance when it turns a
    little in the hand.

    Args:
        stage: Hand and object, all fingers in touch.
        fingers: The fingers that touch.
        touches: How each of them touched first.

    Attributes:
        mean_force_n: Mean normal force asked of a finger, N.
        rest: Posture in which the springs are relaxed, shape (n_q,).
        model: Mass, damping and stiffness of the oscillator that the held object shall be after a step of its
            goal, kg, N s/m and N/m; None where the law promises none.
        pushed_model: The same after a step of a force on it.
    """

    model: tuple[float, float, float] | None = None
    pushed_model: tuple[float, float, float] | None = None

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        self._stage, self._fingers, self._model = stage, fingers, stage.model
        p, body = stage.parameters, stage.world.object_model
        self._gravity = stage.world.scene.gravity
        self._weight_n = body.mass_kg * self._gravity
        self._joints = np.unique(np.concatenate([self._model.finger_joints(f) for f in fingers]))
        self._pinocchio = self._model.model.copy()
        self._data = self._pinocchio.createData()
        self._felt = list(touches)
        self._age = 0
        slowest = 0.3 / stage.time_step_s  # a return within one step would overshoot
        self._return_rate = min(slowest, p.stiffness_nm_rad / max(p.damping_nms_rad, 1e-9))
        self._renew = max(1, round(_RENEW_S / stage.time_step_s))
        self.rest = stage.hand.state()[0]
        self._on = np.arange(len(fingers))
        self._change_s, self._others_n = 0.0, 0.0
        self._applied: FloatArray | None = None
        self._forces = np.zeros((len(fingers), 3))
        self._pads = PadFriction(stage, fingers)
        self._points, self._normals = self._contacts()
        self._balance = ForceBalance(self._points, self._normals, stage.friction.coulomb)
        self._left: float | None = None
        needed = p.grip_safety * self._carrying_force_n()
        steady = max(self._steady_force_n(), _AMPLE * needed)
        self.mean_force_n = float(max(needed, min(p.grip_force_n, steady)))

    def _carrying_force_n(self) -> float:
        """Return the mean normal force that carries the weight, whichever way the hand is turned.

        Where the contacts' normals oppose each other poorly, the grip itself takes up most of the friction,
        and it takes a firmer grip to leave enough of it for the weight.
        """
        _, left = self._balance.forces(1.0)
        share = np.linalg.norm(_weight_sharing(self._points), 2, axis=(1, 2)).max()
        return float(self._weight_n * share / (self._stage.friction.coulomb * max(left, _LEFT)))

    def _steady_force_n(self) -> float:
        """Return the mean normal force up to which the fingers' springs keep the grip from rolling away.

        Opposing forces F on contacts at a distance r from their middle act on a turn of the object like a
        spring of stiffness -F r; it takes the fingers' springs, k r^2, to hold it (Cutkosky and Kao 1989).
        """
        points = np.stack([touch.point for touch in self._felt])
        radius = float(np.linalg.norm(points - points.mean(axis=0), axis=1).min())
        jacobians = self._model.tip_jacobians(self.rest)[list(self._fingers)]
        softest = self._stage.parameters.stiffness_nm_rad / np.linalg.norm(jacobians, 2, axis=(1, 2)) ** 2
        return self._stage.parameters.steady_share * radius * float(softest.min())

    def touches(self) -> list[Touch | None]:
        """Return how each finger touches the object now, None where it does not."""
        touches = self._stage.hand.touches(self._stage.parameters.contact_force_n)
        return [touches[f] for f in self._fingers]

    @property
    def normals(self) -> FloatArray:
        """Normals into the object at the contacts as last felt, in its own frame, shape (n, 3)."""
        return self._normals

    def distribute(self) -> None:
        """Distribute grip force and weight over the contacts as they are felt now."""
        # A finger that has lost touch for a moment is taken to be where it was.
        self._felt = [new or old for new, old in zip(self.touches(), self._felt, strict=True)]
        self._points, self._normals = self._contacts()
        on = self._on
        self._balance = ForceBalance(self._points[on], self._normals[on], self._stage.friction.coulomb)
        self._forces = self._others_n * self._normals
        self._forces[on], _ = self._balance.forces(self.mean_force_n)
        self._age = 0

    def stand_on(self, holding: BoolArray, change_s: float, others_n: float = 0.0) -> None:
        """Grip and carry with some of the fingers only, from now on.

        The forces before and after balance, and so does every mixture of them on the way.

        Args:
            holding: Which contacts hold, shape (n,), two or more.
            change_s: Time constant with which forces change, from now on.
            others_n: Normal force of the others, small beside the grip.
        """
        self._change_s, self._others_n = change_s, others_n
        on = np.flatnonzero(holding)
        if not np.array_equal(on, self._on):
            self._on, self._left = on, None
            self.distribute()

    def _contacts(self) -> tuple[FloatArray, FloatArray]:
        """Return contacts and normals into the object as last felt, in its own frame, shape (n, 3) each."""
        pose = self._stage.world.object_pose()
        points = np.stack([touch.point for touch in self._felt]) - pose[:3, 3]
        return points @ pose[:3, :3], np.stack([touch.normal for touch in self._felt]) @ pose[:3, :3]

    def aim(self, rest: FloatArray, object_in_palm: FloatArray) -> None:
        """Aim at a posture, shape (n_q,), and at the pose of the object in the palm, shape (4, 4), it makes.

        Springs in the joints know of the posture alone.
        """
        self.rest = rest

    def displace(self, offset_m: FloatArray) -> None:
        """Move the goal of the held object at once, palm axes, shape (3,): the springs' posture with it."""
        jacobian = self._model.tip_jacobians(self.rest)[list(self._fingers)].reshape(-1, len(self.rest))
        self.rest = self.rest + np.linalg.pinv(jacobian, rcond=1e-3) @ np.tile(offset_m, len(self._fingers))

    def memory(self) -> Any:
        """Return what `recall` takes to return to the present."""
        return self.rest

    def recall(self, memory: Any) -> None:
        """Return to a time before; what else is known is renewed as time goes on."""
        self.rest = memory

    def rest_here(self) -> None:
        """Let the springs relax in the present posture."""
        self.rest = self._stage.hand.state()[0]

    def drive(self, palm: FloatArray, grip: float, load: float) -> None:
        """Set wrist and fingers for the next step.

        Args:
            palm: Where the palm shall be, shape (4, 4).
            grip: Share of the grip force, 0 to 1.
            load: Share of the object's weight, 0 to 1.
        """
        stage, p = self._stage, self._stage.parameters
        stage.hand.drive_wrist(palm, stage.time_step_s)
        q, velocity = stage.hand.state()
        self._pads.follow_load()
        if self._age % self._renew == 0:
            self._renew_torques(q, palm, loaded=load > 0.0)
        self._age += 1
        applied = grip * self._pressing + load * self._carrying
        if self._change_s > 0.0 and self._applied is not None:
            share = min(1.0, stage.time_step_s / self._change_s)
            applied = self._applied + share * (applied - self._applied)
        self._applied = applied
        torques = self._own_weight + applied
        away = self.rest - q
        springs = p.stiffness_nm_rad * away - p.damping_nms_rad * velocity
        stage.hand.drive_compliantly(torques, springs, self._return_rate * away, self._joints)

    def _renew_torques(self, q: FloatArray, palm: FloatArray, *, loaded: bool) -> None:
        """Compute what depends on the posture, which hardly changes within `_RENEW_S`."""
        rotation = palm[:3, :3] @ self._model.transform_palm_to_root[:3, :3].T
        self._pinocchio.gravity.linear = rotation.T @ np.array([0.0, 0.0, -self._gravity])
        self._own_weight = np.asarray(pinocchio.computeGeneralizedGravity(self._pinocchio, self._data, q))
        to_palm = palm[:3, :3].T @ self._stage.world.object_pose()[:3, :3]
        jacobian_t = self._model.tip_jacobians(q)[list(self._fingers)].reshape(-1, len(q)).T

        def torques(forces: FloatArray) -> FloatArray:
            needed: FloatArray = jacobian_t @ (forces @ to_palm.T).ravel()
            return needed

        pressing = torques(self._forces)
        reachable = self._within_effort(pressing)
        self._pressing = reachable * pressing
        self._carrying = np.zeros_like(q)
        if loaded:
            self._carrying = self._holding(torques, to_palm.T @ palm[2, :3], reachable) - self._pressing

    def _holding(
        self, torques: Callable[[FloatArray], FloatArray], upwards: FloatArray, reachable: float
    ) -> FloatArray:
        """Return the torques of forces that grip and carry the weight at once, shape (n_q,).

        Where the joints are too weak for the whole grip force, it is the weight that comes first: a finger
        that presses from above is no help then.

        Args:
            torques: From forces on the object to joint torques.
            upwards: In the object's frame, shape (3,).
            reachable: Share of the grip force that the joints can do without the weight.
        """
        weight = self._weight_n * upwards
        mean_n = max(reachable * self.mean_force_n, _WEAKEST_N)
        forces = self._forces.copy()  # of those that hold, and of those that only press
        for _ in range(_EFFORT_ROUNDS):
            held, self._left = self._balance.forces(mean_n, weight, self._left)
            if self._left < 0.0:
                break
            forces[self._on] = held
            needed = torques(forces)
            share = self._within_effort(needed)
            if share >= _NEARLY_ALL:
                return needed
            mean_n *= share
        forces = np.zeros_like(self._points)
        forces[self._on] = (_weight_sharing(self._points[self._on]) @ weight).reshape(-1, 3)
        return self._pressing + torques(forces)

    def _within_effort(self, torques: FloatArray) -> float:
        """Return the share of some torques, 0 to 1, that leaves no joint at its limit.

        One share for all fingers: forces that are cut joint by joint are in balance no more.
        """
        limits = _EFFORT_SHARE * self._model.effort_limits
        room = limits - np.sign(torques) * self._own_weight
        wanted = np.abs(torques)
        shares = np.divide(room, wanted, out=np.ones_like(room), where=wanted > 1e-9)
        return float(np.clip(shares[self._joints].min(), 0.0, 1.0))


def _weight_sharing(points: FloatArray) -> FloatArray:
    """Return matrices from a force at the object's centre to least forces at the contacts, shape (n, 3, 3).

    Args:
        points: Contacts from the centre, shape (n, 3), m.
    """
    grasp_map: FloatArray = np.zeros((6, 3 * len(points)))
    for i, arm in enumerate(points):
        grasp_map[:3, 3 * i : 3 * i + 3] = np.eye(3)
        grasp_map[3:, 3 * i : 3 * i + 3] = 10.0 * _cross(arm)
    inverse = np.asarray(np.linalg.pinv(grasp_map, rcond=1e-3), dtype=np.float64)
    return inverse[:, :3].reshape(-1, 3, 3)


def _cross(v: FloatArray) -> FloatArray:
    """Return the matrix of the cross product with a vector, shape (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
