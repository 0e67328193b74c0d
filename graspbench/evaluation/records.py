"""Grasp records made of what the planner found, and of what a trial stored."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.evaluation.grasp_record import ContactSet, GraspRecord, HandPose
from graspbench.evaluation.transforms import inverse
from graspbench.hand.model import HandModel


def record_of_posture(
    hand: HandModel,
    object_name: str,
    transform_palm_to_world: FloatArray,
    joints: FloatArray,
    transform_object_to_world: FloatArray,
    *,
    points: FloatArray | None = None,
    normals: FloatArray | None = None,
    source: str = "graspbench",
    confidence: float | None = None,
) -> GraspRecord:
    """Return the record of a hand in the world.

    Args:
        hand: The hand.
        object_name: What the object is called.
        transform_palm_to_world: Pose of the palm, shape (4, 4).
        joints: Joint positions in the hand's order, shape (n_q,).
        transform_object_to_world: Pose of the object, shape (4, 4).
        points: Contact points in the world, shape (m, 3); None: not known.
        normals: Outward unit normals there, shape (m, 3).
        source: Who planned it.
        confidence: What the planner thinks of it.
    """
    to_object = inverse(transform_object_to_world)
    contacts = None
    if points is not None and normals is not None:
        turn = to_object[:3, :3].T
        contacts = ContactSet(points @ turn + to_object[:3, 3], normals @ turn)
    return GraspRecord(
        hand=hand.name,
        joint_names=hand.joint_names,
        object_name=object_name,
        grasp=HandPose(to_object @ transform_palm_to_world, np.asarray(joints, dtype=np.float64)),
        contacts=contacts,
        transform_object_to_world=transform_object_to_world,
        source=source,
        confidence=confidence,
    )
