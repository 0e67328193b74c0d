"""A grasp as benchmarks exchange it: a hand, an object, where the palm is and how the joints are."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.hand_pose import HandPose

__all__ = ["ContactSet", "GraspRecord", "HandPose"]


@dataclass(frozen=True, eq=False)
class ContactSet:
    """Contacts of a hand with an object.

    Attributes:
        points: In the object's frame, shape (m, 3), m.
        normals: Outward unit normals of the object there, shape (m, 3).
    """

    points: FloatArray
    normals: FloatArray


@dataclass(frozen=True, eq=False)
class GraspRecord:
    """One grasp of one hand on one object, whoever planned it.

    The object's frame has its origin at the centre of mass and its axes as `graspbench.geometry.ObjectModel`
    has them. A record has a hand (``grasp``), contacts, or both.

    Attributes:
        hand: Name of the hand.
        joint_names: The hand's joints, in the order of every joint vector of the record.
        object_name: What the object is called, or where its file said to be.
        object_scale: Metres per unit of the object's mesh file.
        grasp: The hand at the grasp; None where only contacts are given.
        pregrasp: The open hand from which the fingers close; None: not stated.
        squeeze: Where the fingers would go if the object were not there; None: not stated.
        approach: Poses on the way to the pregrasp, in order.
        contacts: Where the planner meant to touch; None: not stated.
        transform_object_to_world: Pose of the object when it was grasped, shape (4, 4); None: upright.
        confidence: What the planner thinks of the grasp; None: it does not say.
        source: Who planned it: a planner's name, or a file's.
    """

    hand: str
    joint_names: tuple[str, ...]
    object_name: str
    object_scale: float = 1.0
    grasp: HandPose | None = None
    pregrasp: HandPose | None = None
    squeeze: HandPose | None = None
    approach: tuple[HandPose, ...] = ()
    contacts: ContactSet | None = None
    transform_object_to_world: FloatArray | None = None
    confidence: float | None = None
    source: str = ""

    @property
    def stages(self) -> tuple[HandPose, ...]:
        """Every stage at which the hand is stated, in order of time."""
        closing = (self.pregrasp, self.grasp, self.squeeze)
        return (*self.approach, *(stage for stage in closing if stage is not None))

    @property
    def up(self) -> FloatArray:
        """Direction against gravity in the object's frame, shape (3,)."""
        if self.transform_object_to_world is None:
            return np.array([0.0, 0.0, 1.0])
        return np.array(self.transform_object_to_world[2, :3])
