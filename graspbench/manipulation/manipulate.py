"""In-hand manipulation: a robot hand moves an object it grasps through a given motion (thesis 4.4)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandModel
from graspbench.manipulation.charts import Chart
from graspbench.manipulation.classification import GraspClass, classify
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import ContactType, ManipulationSystem
from graspbench.manipulation.forces import ForceDistribution, ForceParameters
from graspbench.manipulation.held_object import HeldObject, hold_object
from graspbench.manipulation.loop import ClikHistory
from graspbench.manipulation.manipulation_result import ManipulationResult
from graspbench.manipulation.motion import MotionParameters, Trajectory, object_motion
from graspbench.manipulation.pad_compliance import PadCompliance
from graspbench.manipulation.reach import follow, refusal
from graspbench.reconstruction.surface import Surface

_UNKNOWN_MASS_KG = 0.1


@dataclass(frozen=True)
class ContactParameters:
    """How a hand's fingertips meet the object while they move it."""

    kind: Annotated[
        ContactType,
        Field(description="rolling (spherical tips without slip), hard, soft, soft_pad or frictionless"),
    ] = "rolling"
    patch_radius_m: Annotated[float, Field(gt=0, description="Size of the local charts on a mesh")] = 0.015
    mass_kg: Annotated[
        float | None,
        Field(gt=0, description="Mass of the object, for the contact forces; the object's own if null"),
    ] = None
    force_rate_hz: Annotated[float, Field(gt=0, description="How often contact forces are computed")] = 50.0
    forces: Annotated[ForceParameters, Field(description="Contact force distribution")] = field(
        default_factory=ForceParameters
    )


def manipulate_object(
    hand: HandModel,
    grasp: Grasp,
    surface: Surface | Chart | Sequence[Chart],
    motion: MotionParameters,
    clik: ClikParameters,
    contact: ContactParameters | None = None,
    *,
    transform_object_to_world: FloatArray | None = None,
    gravity: float = 9.81,
) -> ManipulationResult:
    """Move a grasped object through a motion by the fingers alone; the palm stays.

    Args:
        hand: The hand.
        grasp: Grasp with the hand's posture, its contacts in the world.
        surface: The object's reconstructed surface in the world, from which a chart is fitted around
            each contact; or one chart for all contacts, or one a contact, in the object frame.
        motion: What the object shall do, in palm axes.
        clik: Inverse kinematics and secondary tasks.
        contact: Contact type and forces.
        transform_object_to_world: The object's pose; by default its frame is at the grasp's centroid with the
            world's axes.
        gravity: For the contact forces, m/s^2.

    Raises:
        HandError: The grasp has no posture.
        ManipulationError: The grasp cannot follow the motion; the message says how far it can.
    """
    chosen = contact or ContactParameters()
    held = hold_object(
        hand,
        grasp,
        surface,
        chosen.kind,
        patch_radius_m=chosen.patch_radius_m,
        transform_object_to_world=transform_object_to_world,
    )
    palm, trajectory = held.transform_palm_to_world, object_motion(motion, held.position, held.rotation)
    grasp_class = classify(held.system.state(held.joints, held.variables))
    forces = _ForceRecorder(chosen, trajectory, palm[:3, :3], clik.step_s, gravity, held.system)
    held = forces.settled(held)
    reach, history = follow(held, motion, clik, watch=forces.watch)
    if history is None:
        raise refusal(reach)
    return _result(held.system, history, grasp_class, forces, hand, palm)


class _ForceRecorder:
    """Computes contact forces at a lower rate while the motion runs; soft pads give way to them."""

    def __init__(
        self,
        parameters: ContactParameters,
        trajectory: Trajectory,
        to_world: FloatArray,
        step_s: float,
        gravity: float,
        system: ManipulationSystem,
    ) -> None:
        self.times: list[float] = []
        self.forces: list[FloatArray] = []
        self.margins: list[float] = []
        self._every = max(round(1.0 / (parameters.force_rate_hz * step_s)), 1)
        self._step_s, self._trajectory = step_s, trajectory
        self._mass = _UNKNOWN_MASS_KG if parameters.mass_kg is None else parameters.mass_kg
        self._gravity = gravity * to_world.T @ np.array([0.0, 0.0, 1.0])
        self._distribute = ForceDistribution(parameters.forces)
        self.pads = PadCompliance(system, parameters.forces.pad) if parameters.kind == "soft_pad" else None
        self.deflections: list[FloatArray] = []

    def settled(self, held: HeldObject) -> HeldObject:
        """Return the start with its pads loaded, if there are any and forces balance the weight."""
        if self.pads is None:
            return held
        try:
            found = self._distribute(held.system.state(held.joints, held.variables), self._load(0.0))
        except ManipulationError:
            return held
        return self.pads.settled(held, found)

    def watch(self, clik: Clik, period: int) -> None:
        """Record the forces of a period, if they are due, and let the pads give way until the next one."""
        if self.pads is not None:
            self.deflections.append(self.pads.deflections)
        if period % self._every == 0:
            self._record(clik, period * self._step_s)
        if self.pads is not None:
            self.pads.pass_time((period % self._every + 1) / self._every)

    def _record(self, clik: Clik, time_s: float) -> None:
        self.times.append(time_s)
        try:
            found = self._distribute(clik.state, self._load(time_s))
        except ManipulationError:
            self.forces.append(np.full((clik.system.n_contacts, 3), np.nan))
            self.margins.append(float("nan"))
            return
        self.forces.append(found.forces)
        self.margins.append(found.smallest_margin)
        if self.pads is not None:
            self.pads.load(clik.state, found)

    def _load(self, time_s: float) -> FloatArray:
        """Return the wrench that the fingers have to apply to the object, shape (6,)."""
        load = np.zeros(6)
        # a point mass: the torque of a small object's angular acceleration is negligible here
        load[:3] = self._mass * (self._trajectory(time_s).acceleration[:3] + self._gravity)
        return load


def _result(
    system: ManipulationSystem,
    history: ClikHistory,
    grasp_class: GraspClass,
    forces: _ForceRecorder,
    hand: HandModel,
    palm: FloatArray,
) -> ManipulationResult:
    actual = np.tile(np.eye(4), (len(history.times), 1, 1))
    wanted = actual.copy()
    actual[:, :3, :3] = history.object_rotations[:, 0]
    actual[:, :3, 3] = history.object_positions.mean(axis=1)
    wanted[:, :3, :3], wanted[:, :3, 3] = history.desired_rotations, history.desired_positions
    points, drift = _contacts(system, history, wanted, forces)
    return ManipulationResult(
        history=history,
        joint_names=hand.joint_names,
        grasp_class=grasp_class,
        transform_palm_to_world=palm,
        transforms_object_to_palm=actual,
        desired_transforms_object_to_palm=wanted,
        position_error_m=np.linalg.norm(history.pose_errors[:, :, :3], axis=2).max(axis=1),
        rotation_error_deg=np.rad2deg(np.linalg.norm(history.pose_errors[:, :, 3:], axis=2).max(axis=1)),
        contact_points=points,
        contact_drift_m=drift,
        force_times=np.array(forces.times),
        forces=np.array(forces.forces),
        force_margins=np.array(forces.margins),
        pad_indentation_max_m=None if forces.pads is None else forces.pads.indentation_max_m,
    )


def _contacts(
    system: ManipulationSystem, history: ClikHistory, wanted: FloatArray, forces: _ForceRecorder
) -> tuple[FloatArray, FloatArray]:
    """Return the contacts' points, and how far the tips are from them on the object as it should be.

    The tip's centre comes from the joints alone and the contact from the contact variables alone, so the
    distance tells whether the contact holds: whether it is where its type lets it be.
    """
    state = system.state(history.joints[0], history.contact_variables[0])
    points = np.zeros((len(history.times), system.n_contacts, 3))
    drift = np.zeros(points.shape[:2])
    radii = system.arrays.tip_radii[:, None]
    for k in range(len(points)):
        if forces.pads is not None:
            forces.pads.apply(forces.deflections[k])
        state.update(history.joints[k], history.contact_variables[k])
        points[k] = state.surface_points
        tips = (state.tip_positions - wanted[k, :3, 3]) @ wanted[k, :3, :3]
        drift[k] = np.linalg.norm(tips - points[k] - radii * state.surface_normals, axis=1)
    return points, drift
