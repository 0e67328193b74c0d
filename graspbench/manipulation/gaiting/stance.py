"""All fingers on the object between two motions, and the motions that lead from one stance to the next."""

from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.hand import HandModel
from graspbench.manipulation.classification import classify
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.force_recorder import ForceRecorder
from graspbench.manipulation.forces import ForceDistribution
from graspbench.manipulation.gaiting.finger_step import Stepping
from graspbench.manipulation.gaiting.gait_parameters import GaitParameters
from graspbench.manipulation.gaiting.gait_result import Piece
from graspbench.manipulation.gaiting.regrasp import Placement, Stand
from graspbench.manipulation.gaiting.turning import Turning
from graspbench.manipulation.held_object import HeldObject, hand_tree
from graspbench.manipulation.loop import ClikHistory
from graspbench.manipulation.manipulation_result import ManipulationResult
from graspbench.manipulation.motion import MotionParameters, object_motion, quintic
from graspbench.manipulation.motion_result import motion_result
from graspbench.manipulation.reach import follow

_FAST = 0.9
"""Share of a joint's largest velocity that is used."""
_PEAK = 1.875
"""Largest rate of the quintic time law."""
_ROUNDS = 5
_SHORTER = 0.95
_LEAST_DEG = 0.5
_PAUSE_S = 0.1
_LOOK_S = 0.02


@dataclass(frozen=True, eq=False)
class Stance:
    """All fingers on the object, at rest.

    Attributes:
        contacts: The contacts with their charts.
        coordinates: Where on them the tips touch, shape (n_c, 2).
        joints: Shape (n_q,), rad.
        turned_deg: How far the object has turned.
    """

    contacts: tuple[Contact, ...]
    coordinates: FloatArray
    joints: FloatArray
    turned_deg: float

    def stand(self) -> Stand:
        """Return the contacts' points and normals with the joints."""
        at = [c.chart(xi) for c, xi in zip(self.contacts, self.coordinates, strict=True)]
        return Stand(
            np.array([each.point for each in at]), np.array([each.frame[:, 2] for each in at]), self.joints
        )


class Moves:
    """Turns and steps from stances.

    Args:
        hand: The hand.
        fingers: Finger of each contact.
        turning: How the object turns in the palm.
        transform_palm_to_world: Pose of the palm, shape (4, 4).
        clik: Inverse kinematics of the turns.
        contact: The contacts.
        gait: Speeds.
        stepping: What is in the fingers' way.
        gravity: m/s^2.

    Attributes:
        ended_by: What ended the turn last asked for; empty if nothing did.
    """

    def __init__(
        self,
        hand: HandModel,
        fingers: tuple[int, ...],
        turning: Turning,
        transform_palm_to_world: FloatArray,
        clik: ClikParameters,
        contact: ContactParameters,
        gait: GaitParameters,
        stepping: Stepping,
        gravity: float,
    ) -> None:
        self._hand, self._fingers, self._turning = hand, fingers, turning
        self._palm, self._clik, self._contact, self._gait = transform_palm_to_world, clik, contact, gait
        self._stepping, self._gravity = stepping, gravity
        self.ended_by = ""

    def turn(self, stance: Stance, angle_deg: float) -> tuple[Stance, Piece] | None:
        """Turn the object with all fingers as far as they go, at most by an angle; None if hardly at all."""
        duration = abs(angle_deg) / self._gait.turn_speed_deg_s
        for _ in range(_ROUNDS):
            if abs(angle_deg) < _LEAST_DEG:
                return None
            share, done = self._follow(stance, angle_deg, duration)
            if done is None:
                angle_deg, duration = _SHORTER * share * angle_deg, max(_SHORTER * share, 1e-3) * duration
                continue
            speeds = np.abs(done[1].velocities[:, : self._hand.n_joints]).max(axis=0)
            slower = float((speeds / (_FAST * self._hand.velocity_limits)).max())
            if slower > 1.0:
                duration *= 1.02 * slower
                continue
            return self._turned(stance, angle_deg, duration, *done)
        return None

    def pause(self, stance: Stance) -> Piece | None:
        """Hold the object still for a moment; None if the fingers do not hold it."""
        _, done = self._follow(stance, 0.0, _PAUSE_S)
        return None if done is None else self._turned(stance, 0.0, _PAUSE_S, *done)[1]

    def _follow(
        self, stance: Stance, angle_deg: float, duration_s: float
    ) -> tuple[float, tuple[HeldObject, ClikHistory, ForceRecorder] | None]:
        """Return the share of a turn that can be done, and the turn if all of it can."""
        everyone = tuple(range(len(self._fingers)))
        held = self._held(stance, everyone)
        x, y, z = angle_deg * self._turning.axis
        motion = MotionParameters("gait", (0.0, 0.0, 0.0), (x, y, z), duration_s, there_and_back=False)
        recorder = ForceRecorder(
            self._contact,
            object_motion(motion, held.position, held.rotation),
            self._palm[:3, :3],
            self._clik.step_s,
            self._gravity,
            held.system,
        )
        lower, upper, step_s = self._hand.lower, self._hand.upper, self._clik.step_s
        every = max(1, round(_LOOK_S / step_s))

        def watch(law: Clik, period: int) -> None:
            joints = law.state.joints
            if np.any(joints < lower) or np.any(joints > upper):
                raise ManipulationError("a joint is at its limit")
            if period % every == 0:
                pose = np.eye(4)
                pose[:3, :3], pose[:3, 3] = law.reference(period * step_s).rotation, held.position
                if not self._stepping.is_clear(joints[None], pose, self._fingers):
                    raise ManipulationError("links of the hand meet the object or each other")
            recorder.watch(law, period)
            if np.isnan(recorder.margins[-1]):
                raise ManipulationError("no contact forces balance the weight")

        reach, history = follow(held, motion, self._clik, watch=watch)
        self.ended_by = reach.ended_by or ""
        return reach.share, None if history is None else (held, history, recorder)

    def _turned(
        self,
        stance: Stance,
        angle_deg: float,
        duration_s: float,
        held: HeldObject,
        history: ClikHistory,
        recorder: ForceRecorder,
    ) -> tuple[Stance, Piece]:
        grasp_class = classify(held.system.state(held.joints, held.variables))
        result = motion_result(held, history, grasp_class, recorder)
        shares = np.array([quintic(t / duration_s)[0] for t in history.times])
        after = replace(
            stance,
            coordinates=history.contact_variables[-1, :, :2].copy(),
            joints=history.joints[-1].copy(),
            turned_deg=stance.turned_deg + angle_deg,
        )
        return after, Piece(result, stance.turned_deg + shares * angle_deg, None)

    def step(self, stance: Stance, placement: Placement, before: Piece) -> tuple[Stance, Piece] | None:
        """Take one step; None if no forces of the other fingers carry the weight.

        Args:
            stance: The fingers before it.
            placement: The planned step.
            before: What came before; its last sample tells how the other fingers hold.
        """
        i = placement.contact
        contacts = list(stance.contacts)
        contacts[i] = replace(contacts[i], chart=placement.chart)
        others = tuple(k for k in range(len(self._fingers)) if k != i)
        held = self._held(stance, others)
        try:
            load = np.append(self._weight(), np.zeros(3))
            found = ForceDistribution(self._contact.forces)(
                held.system.state(held.joints, held.variables), load
            )
        except ManipulationError:
            return None
        coordinates = stance.coordinates.copy()
        coordinates[i], joints = 0.0, placement.way.joints[-1].copy()
        after = replace(stance, contacts=tuple(contacts), coordinates=coordinates, joints=joints)
        path, period = placement.way.path(), self._clik.step_s
        rates = np.abs(path(np.linspace(0.0, 1.0, 400), 1)).max(axis=0)
        fastest = _PEAK * float((rates / (_FAST * self._hand.velocity_limits)).max())
        count = int(np.ceil(max(self._gait.step_time_s, fastest) / period))
        law = np.array([quintic(k / count)[:2] for k in range(count + 1)])
        all_joints = path(law[:, 0])
        all_joints[-1] = joints
        velocities = np.zeros((count + 1, before.result.history.velocities.shape[1]))
        velocities[:, : self._hand.n_joints] = path(law[:, 0], 1) * law[:, 1:] / (count * period)
        every = max(round(1.0 / (self._contact.force_rate_hz * period)), 1)
        n_forces = len(range(0, count + 1, every))
        forces, torsions = np.zeros((len(self._fingers), 3)), np.zeros(len(self._fingers))
        forces[list(others)], torsions[list(others)] = found.forces, found.torsions
        result = _at_rest(before, i, period * np.arange(count + 1.0), all_joints, velocities)
        result = replace(
            result,
            force_times=period * every * np.arange(float(n_forces)),
            forces=np.tile(forces, (n_forces, 1, 1)),
            torsions=np.tile(torsions, (n_forces, 1)),
            force_margins=np.full(n_forces, found.smallest_margin),
        )
        # on the ground it leaves and on that it reaches
        ends = after.stand()
        result.contact_points[-1, i], result.contact_normals[-1, i] = ends.points[i], ends.normals[i]
        first = stance.stand()
        result.contact_points[0, i], result.contact_normals[0, i] = first.points[i], first.normals[i]
        return after, Piece(result, np.full(count + 1, stance.turned_deg), i)

    def _weight(self) -> FloatArray:
        mass = self._contact.carried_kg
        up: FloatArray = self._palm[:3, :3].T @ np.array([0.0, 0.0, mass * self._gravity])
        return up

    def _held(self, stance: Stance, contacts: tuple[int, ...]) -> HeldObject:
        """Return the object in the hold of some of the contacts."""
        pose = self._turning.pose(stance.turned_deg)
        tree = hand_tree(self._hand, [self._fingers[k] for k in contacts])
        rough = ManipulationSystem(tree, [stance.contacts[k] for k in contacts])
        system, variables = rough.grasped(
            stance.joints, pose[:3, 3], pose[:3, :3], coordinates=stance.coordinates[list(contacts)]
        )
        return HeldObject(
            system, stance.joints, variables, pose[:3, 3], pose[:3, :3], self._palm, self._hand.joint_names
        )


def _at_rest(
    before: Piece, stepping: int, times: FloatArray, joints: FloatArray, velocities: FloatArray
) -> ManipulationResult:
    """Return a motion of one finger while all else stays as it was last; its forces are still to come."""
    last, n = before.result, len(times)

    def still(values: FloatArray, *, by_contact: bool = False) -> FloatArray:
        out = np.repeat(values[-1:], n, axis=0)
        if by_contact:
            out[:, stepping] = np.nan
        return out

    was = last.history
    history = ClikHistory(
        times=times,
        joints=joints,
        contact_variables=still(was.contact_variables, by_contact=True),
        velocities=velocities,
        desired_positions=still(was.desired_positions),
        desired_rotations=still(was.desired_rotations),
        pose_errors=still(was.pose_errors, by_contact=True),
        object_positions=still(was.object_positions, by_contact=True),
        object_rotations=still(was.object_rotations, by_contact=True),
        closed_chain_residual_m=still(was.closed_chain_residual_m),
        smallest_singular_value=np.full(n, np.nan),
        activations=np.zeros((n, was.activations.shape[1])),
        task_names=was.task_names,
    )
    drift = still(last.contact_drift_m)
    drift[:, stepping] = 0.0
    return replace(
        last,
        history=history,
        transforms_object_to_palm=still(last.transforms_object_to_palm),
        desired_transforms_object_to_palm=still(last.desired_transforms_object_to_palm),
        position_error_m=still(last.position_error_m),
        rotation_error_deg=still(last.rotation_error_deg),
        contact_points=still(last.contact_points, by_contact=True),
        contact_normals=still(last.contact_normals, by_contact=True),
        contact_drift_m=drift,
    )
