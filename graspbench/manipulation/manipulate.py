"""In-hand manipulation: a robot hand moves an object it grasps through a given motion (thesis 4.4)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import HandError, ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandModel
from graspbench.manipulation.charts import Chart, mesh_patch
from graspbench.manipulation.classification import GraspClass, classify
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ContactType, ManipulationSystem
from graspbench.manipulation.forces import ForceDistribution, ForceParameters
from graspbench.manipulation.kinematic_tree import KinematicTree, tree_from_pinocchio
from graspbench.manipulation.loop import ClikHistory, simulate
from graspbench.manipulation.manipulation_result import ManipulationResult
from graspbench.manipulation.motion import MotionParameters, Trajectory, object_motion
from graspbench.manipulation.secondary_task import build_tasks
from graspbench.reconstruction.surface import Surface

_UNKNOWN_MASS_KG = 0.1


@dataclass(frozen=True)
class ContactParameters:
    """How a hand's fingertips meet the object while they move it."""

    kind: Annotated[
        ContactType, Field(description="rolling (spherical tips without slip), hard, soft or frictionless")
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
        ManipulationError: A contact leaves its chart or the kinematics cannot go on.
    """
    chosen = contact or ContactParameters()
    posture = grasp.posture
    if posture is None:
        raise HandError("the grasp has no hand posture", remedy="plan it with a hand")
    pose = np.eye(4) if transform_object_to_world is None else np.array(transform_object_to_world)
    if transform_object_to_world is None:
        pose[:3, 3] = grasp.centroid
    fingers = posture.fingers
    charts = _charts(surface, grasp, pose, chosen.patch_radius_m)
    contacts = [Contact(chart, chosen.kind, hand.tip_radius_m) for chart in charts]
    tree = hand_tree(hand, fingers)
    to_palm = np.linalg.inv(posture.transform_palm_to_world) @ pose
    rough = ManipulationSystem(tree, contacts)
    touching = _contact_coordinates(charts, grasp, pose)
    joints = _touch(rough, posture.joints, touching, to_palm)
    system, variables = rough.grasped(joints, to_palm[:3, 3], to_palm[:3, :3], coordinates=touching)

    trajectory = object_motion(motion, to_palm[:3, 3], to_palm[:3, :3])
    law = Clik(system, trajectory, clik, build_tasks(clik.tasks))
    grasp_class = classify(system.state(joints, variables))
    forces = _ForceRecorder(chosen, trajectory, posture.transform_palm_to_world[:3, :3], clik.step_s, gravity)
    history = simulate(law, joints, variables, motion.duration_s, watch=forces.watch)
    return _result(system, history, grasp_class, forces, hand, posture.transform_palm_to_world)


def hand_tree(hand: HandModel, fingers: Sequence[int]) -> KinematicTree:
    """Return the tree of a hand in its palm frame, with one tip for each of the chosen fingers."""
    tree = tree_from_pinocchio(hand.model, [hand.tip_links[finger] for finger in fingers])
    to_palm = np.linalg.inv(hand.transform_palm_to_root)
    rotations, translations = tree.placement_rotations.copy(), tree.placement_translations.copy()
    for joint in np.flatnonzero(tree.parents < 0):
        rotations[joint] = to_palm[:3, :3] @ rotations[joint]
        translations[joint] = to_palm[:3, :3] @ translations[joint] + to_palm[:3, 3]
    return replace(
        tree,
        placement_rotations=rotations,
        placement_translations=translations,
        lower=hand.lower,
        upper=hand.upper,
        velocity_limits=hand.velocity_limits,
    )


def _charts(
    surface: Surface | Chart | Sequence[Chart], grasp: Grasp, pose: FloatArray, radius_m: float
) -> list[Chart]:
    n = len(grasp.points)
    if isinstance(surface, Chart):
        return [surface] * n
    if not isinstance(surface, Surface):
        return list(surface)
    inverse = np.linalg.inv(pose)
    points = surface.points @ inverse[:3, :3].T + inverse[:3, 3]
    centres = grasp.points @ inverse[:3, :3].T + inverse[:3, 3]
    normals = grasp.normals @ inverse[:3, :3].T
    return [
        mesh_patch(points, centre, normal, radius_m=radius_m)
        for centre, normal in zip(centres, normals, strict=True)
    ]


def _contact_coordinates(charts: Sequence[Chart], grasp: Grasp, pose: FloatArray) -> FloatArray:
    """Return where on its chart each contact of the grasp lies, shape (n_c, 2)."""
    points = (grasp.points - pose[:3, 3]) @ pose[:3, :3]
    return np.array([chart.locate(point) for chart, point in zip(charts, points, strict=True)])


def _touch(
    system: ManipulationSystem, joints: FloatArray, coordinates: FloatArray, to_palm: FloatArray
) -> FloatArray:
    """Close the gap a planned posture leaves: bring each tip's centre exactly to radius from its contact.

    A posture was planned for the normals of a mesh; those of the smooth charts are a little different. The
    contacts stay where they were planned: a tip's nearest point would jump where the surface bends
    more than the tip.
    """
    q = np.array(joints, dtype=np.float64)
    state = system.state(q, np.zeros((system.n_contacts, 5)))
    targets = np.empty((system.n_contacts, 3))
    for i, contact in enumerate(system.contacts):
        at = contact.chart(coordinates[i])
        targets[i] = to_palm[:3, :3] @ (at.point + contact.tip_radius_m * at.frame[:, 2]) + to_palm[:3, 3]
    for _ in range(40):
        misses = targets - state.tip_positions
        if np.abs(misses).max() < 1e-12:
            return q
        stacked = state.tip_jacobians[:, :3].reshape(-1, system.n_joints)
        change = np.linalg.pinv(stacked, rcond=1e-3) @ misses.ravel()
        q = np.clip(q + change, system.tree.lower, system.tree.upper)
        state.update(q, state.contact_variables)
    gap = float(np.linalg.norm(targets - state.tip_positions, axis=1).max())
    if gap > 1e-7:
        raise ManipulationError(
            f"a fingertip stays {gap * 1e3:.3f} mm off the surface at the start",
            remedy="plan the grasp with a larger hand.margins.joint",
            gap_m=gap,
        )
    return q


class _ForceRecorder:
    """Computes contact forces at a lower rate while the motion runs."""

    def __init__(
        self,
        parameters: ContactParameters,
        trajectory: Trajectory,
        to_world: FloatArray,
        step_s: float,
        gravity: float,
    ) -> None:
        self.times: list[float] = []
        self.forces: list[FloatArray] = []
        self.margins: list[float] = []
        self._every = max(round(1.0 / (parameters.force_rate_hz * step_s)), 1)
        self._step_s, self._trajectory = step_s, trajectory
        self._mass = _UNKNOWN_MASS_KG if parameters.mass_kg is None else parameters.mass_kg
        self._gravity = gravity * to_world.T @ np.array([0.0, 0.0, 1.0])
        self._distribute = ForceDistribution(parameters.forces)

    def watch(self, clik: Clik, period: int) -> None:
        if period % self._every:
            return
        time_s = period * self._step_s
        load = np.zeros(6)
        # a point mass: the torque of a small object's angular acceleration is negligible here
        load[:3] = self._mass * (self._trajectory(time_s).acceleration[:3] + self._gravity)
        self.times.append(time_s)
        try:
            found = self._distribute(clik.state, load)
        except ManipulationError:
            self.forces.append(np.full((clik.system.n_contacts, 3), np.nan))
            self.margins.append(float("nan"))
        else:
            self.forces.append(found.forces)
            self.margins.append(found.smallest_margin)


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
    points, drift = _contacts(system, history, wanted)
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
    )


def _contacts(
    system: ManipulationSystem, history: ClikHistory, wanted: FloatArray
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
        state.update(history.joints[k], history.contact_variables[k])
        points[k] = state.surface_points
        tips = (state.tip_positions - wanted[k, :3, 3]) @ wanted[k, :3, :3]
        drift[k] = np.linalg.norm(tips - points[k] - radii * state.surface_normals, axis=1)
    return points, drift
