"""The configuration of a whole hand."""

from dataclasses import dataclass

from graspbench.arrays import FloatArray


@dataclass(frozen=True)
class HandPosture:
    """A hand that holds its fingertips at a grasp's contacts.

    Attributes:
        transform_palm_to_world: Pose of the palm frame, shape (4, 4). The palm frame's z axis is the
            approach direction: it points from the palm towards the object.
        joints: Joint positions in the hand model's order, shape (n_q,), rad.
        fingers: Finger ``fingers[i]`` touches contact i.
        tip_error_m: Largest distance between a fingertip's centre and its target.
        joint_margin: Smallest distance of a joint to a limit, as a share of its range (0 to 0.5).
        smallest_singular_value: Smallest singular value of the used fingers' tip Jacobians, m/rad.
        clearance_m: Smallest distance between fingers, palm and ground, negative when they collide.
    """

    transform_palm_to_world: FloatArray
    joints: FloatArray
    fingers: tuple[int, ...]
    tip_error_m: float
    joint_margin: float
    smallest_singular_value: float
    clearance_m: float
