"""The independent check of a contact on a link's real shape: Coal's distances, nothing of the search."""

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.hand.coal_shapes import TOLERANCE_M, convex, signed_distance
from graspbench.hand.model import HandModel

_GRAIN_M = 1e-6


def check_touch(
    hand: HandModel,
    joint: int,
    placements: Sequence[pinocchio.SE3],
    point: FloatArray,
    normal: FloatArray,
    finger: str,
) -> list[str]:
    """Check that a last link touches at a contact, and that nothing of it there is behind the tangent plane.

    The contact has to be within 0.1 mm of one of the link's shapes. A flat slab behind the contact, two
    fingertips wide, stands for the object: no shape may be deeper in it than 0.1 mm.

    Args:
        hand: The hand.
        joint: Pinocchio's number of the joint that moves the link.
        placements: Where its collision shapes are in the world.
        point: The contact, shape (3,), m.
        normal: The object's outward unit normal there, shape (3,).
        finger: Name of the finger.

    Returns:
        What is wrong, one clause each.
    """
    reach = 2.0 * hand.pad_radius_m
    slab = coal.Box(2.0 * reach, 2.0 * reach, reach)
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    across = np.cross(helper, normal) / np.linalg.norm(np.cross(helper, normal))
    turn = np.column_stack((across, np.cross(normal, across), normal))
    behind = pinocchio.SE3(turn, point - 0.5 * reach * normal)
    grain = pinocchio.SE3(np.eye(3), np.array(point, dtype=float))
    nearest, deepest = np.inf, 0.0
    for item, placement in zip(hand.geometry.geometryObjects, placements, strict=True):
        if item.parentJoint != joint:
            continue
        shape = convex(item.geometry)
        nearest = min(
            nearest, abs(signed_distance(shape, placement, coal.Sphere(_GRAIN_M), grain) + _GRAIN_M)
        )
        deepest = max(deepest, -signed_distance(shape, placement, slab, behind))
    found = []
    if nearest > TOLERANCE_M:
        found.append(f"the last link of finger '{finger}' is {nearest * 1e3:.2f} mm from its contact")
    if deepest > TOLERANCE_M:
        found.append(
            f"the last link of finger '{finger}' is {deepest * 1e3:.2f} mm behind its contact's plane"
        )
    return found
