"""A hand at an object: where its palm is and how its joints are."""

from dataclasses import dataclass

from graspbench.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class HandPose:
    """Palm and joints at one stage of a grasp.

    Attributes:
        transform_palm_to_object: Pose of the hand's palm frame in the object's frame, shape (4, 4).
        joints: Joint positions in the hand model's order, shape (n_q,), rad (slides: m).
    """

    transform_palm_to_object: FloatArray
    joints: FloatArray
