"""A computed motion of hand and object, with what follows from it."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.manipulation.classification import GraspClass
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.force_recorder import ForceRecorder
from graspbench.manipulation.held_object import HeldObject
from graspbench.manipulation.loop import ClikHistory
from graspbench.manipulation.manipulation_result import ManipulationResult


def motion_result(
    held: HeldObject, history: ClikHistory, grasp_class: GraspClass, forces: ForceRecorder
) -> ManipulationResult:
    """Return what came of a motion.

    Args:
        held: Where it started.
        history: The motion.
        grasp_class: Class of the grasp at the start.
        forces: The contact forces along it.
    """
    system, palm = held.system, held.transform_palm_to_world
    actual = np.tile(np.eye(4), (len(history.times), 1, 1))
    wanted = actual.copy()
    actual[:, :3, :3] = history.object_rotations[:, 0]
    actual[:, :3, 3] = history.object_positions.mean(axis=1)
    wanted[:, :3, :3], wanted[:, :3, 3] = history.desired_rotations, history.desired_positions
    points, normals, drift = _contacts(system, history, wanted, forces)
    return ManipulationResult(
        history=history,
        joint_names=held.joint_names,
        grasp_class=grasp_class,
        transform_palm_to_world=palm,
        transforms_object_to_palm=actual,
        desired_transforms_object_to_palm=wanted,
        position_error_m=np.linalg.norm(history.pose_errors[:, :, :3], axis=2).max(axis=1),
        rotation_error_deg=np.rad2deg(np.linalg.norm(history.pose_errors[:, :, 3:], axis=2).max(axis=1)),
        contact_points=points,
        contact_normals=normals,
        contact_drift_m=drift,
        force_times=np.array(forces.times),
        forces=np.array(forces.forces),
        torsions=np.array(forces.torsions),
        force_margins=np.array(forces.margins),
        pad_indentation_max_m=None if forces.pads is None else forces.pads.indentation_max_m,
    )


def _contacts(
    system: ManipulationSystem, history: ClikHistory, wanted: FloatArray, forces: ForceRecorder
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the contacts' points and normals, and how far the tips are from them on the object.

    The tip's centre comes from the joints alone and the contact from the contact variables alone, so the
    distance tells whether the contact holds: whether it is where its type lets it be.
    """
    state = system.state(history.joints[0], history.contact_variables[0])
    points = np.zeros((len(history.times), system.n_contacts, 3))
    normals = np.zeros_like(points)
    drift = np.zeros(points.shape[:2])
    radii = system.arrays.tip_radii[:, None]
    for k in range(len(points)):
        if forces.pads is not None:
            forces.pads.apply(forces.deflections[k])
        state.update(history.joints[k], history.contact_variables[k])
        points[k], normals[k] = state.surface_points, state.surface_normals
        tips = (state.tip_positions - wanted[k, :3, 3]) @ wanted[k, :3, :3]
        drift[k] = np.linalg.norm(tips - points[k] - radii * normals[k], axis=1)
    return points, normals, drift
