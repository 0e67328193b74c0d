"""Does a moving hand run into the object or the ground on its way?"""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.hand.collision import EVERY_FINGER, ground_clearance, hand_clearance
from graspbench.hand.model import HandModel
from graspbench.hand.penetration import DEPTH_M, Triangles, links_sink
from graspbench.hand.shapes import Shapes
from graspbench.hand.task import make_system


def collisions(
    hand: HandModel,
    triangles: Triangles,
    transforms_palm_to_world: FloatArray,
    joints: FloatArray,
    closing: int,
    fingers: tuple[int, ...],
    ground_height_m: float | None = None,
    hand_margin_m: float | None = None,
) -> BoolArray:
    """Tell at which samples of a motion palm, links or fingertips sink into a surface or the ground.

    Args:
        hand: The hand.
        triangles: The surface, in the world.
        transforms_palm_to_world: Poses of the palm, shape (t, 4, 4).
        joints: Joint positions, shape (t, n_q), rad.
        closing: First sample from which the tips of ``fingers`` close on their contacts and do not count.
        fingers: The fingers with a contact.
        ground_height_m: Height of the ground in the world; None for none.
        hand_margin_m: Samples count too at which links of the hand come nearer to each other; None: they
            do not.

    Returns:
        Shape (t,).
    """
    free: IntArray = np.full(hand.n_fingers, -1, dtype=np.int64)
    on_contact = free.copy()
    on_contact[list(fingers)] = np.arange(len(fingers))
    system = make_system(hand.chains, hand.shapes)
    height = -np.inf if ground_height_m is None else float(ground_height_m)
    sunk = np.zeros(len(joints), dtype=np.bool_)
    for k, (pose, q) in enumerate(zip(transforms_palm_to_world, joints, strict=True)):
        contact_of = on_contact if k >= closing else free
        palm = np.ascontiguousarray(pose[:3])
        sunk[k] = (
            links_sink(
                hand.chains, hand.shapes, triangles, contact_of, palm, hand.by_finger(q), system, DEPTH_M
            )
            or _below(hand.shapes, system.poses, palm, height, DEPTH_M)
            or (hand_margin_m is not None and _tangled(hand.shapes, system.poses, hand_margin_m))
        )
    return sunk


@compiled
def _below(shapes: Shapes, poses: FloatArray, pose: FloatArray, height: float, depth: float) -> bool:
    """Tell whether shapes whose poses are known are deeper in the ground than tolerated."""
    if height == -np.inf:
        return False
    clearance: float = ground_clearance(shapes, poses, pose, height, EVERY_FINGER, 0.0)
    return clearance < -depth


@compiled
def _tangled(shapes: Shapes, poses: FloatArray, margin: float) -> bool:
    """Tell whether links of the hand, whose poses are known, come nearer to each other than a margin."""
    clearance: float = hand_clearance(shapes, poses, EVERY_FINGER, margin + 1e-9)
    return clearance < margin
