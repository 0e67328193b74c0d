"""Where fingertips are and how they slide, from joint positions and contact points alone (Pinocchio).

For checks of in-hand motions: nothing of what planned these is used.
"""

from collections.abc import Sequence

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.hand import HandModel


def tip_poses(hand: HandModel, fingers: Sequence[int], joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centres and orientations of tips in the palm frame, shape (t, n_c, 3) and (t, n_c, 3, 3).

    Args:
        hand: The hand.
        fingers: Its finger at each contact.
        joints: Shape (t, n_q).
    """
    model, data = hand.model, hand.model.createData()
    to_palm = np.linalg.inv(hand.transform_palm_to_root)
    frames = [model.getFrameId(hand.tip_links[finger]) for finger in fingers]
    tips = np.empty((len(joints), len(frames), 3))
    rotations = np.empty((len(joints), len(frames), 3, 3))
    for k, q in enumerate(joints):
        pinocchio.forwardKinematics(model, data, q)
        for i, frame in enumerate(frames):
            placement = pinocchio.updateFramePlacement(model, data, frame)
            tips[k, i] = to_palm[:3, :3] @ placement.translation + to_palm[:3, 3]
            rotations[k, i] = to_palm[:3, :3] @ placement.rotation
    return tips, rotations


def slid_m(points: FloatArray, tips: FloatArray, rotations: FloatArray, poses: FloatArray) -> FloatArray:
    """Return how one tip's surface slides over the object's from sample to sample, palm frame, (t - 1, 3).

    What touches moves with the tip and with the object; the mean of where it is seen to go from the sample's
    start and from its end has an error of third order.

    Args:
        points: The contact, object frame, shape (t, 3).
        tips: The tip's centre, palm frame, shape (t, 3).
        rotations: Its orientation, shape (t, 3, 3).
        poses: The object's, shape (t, 4, 4).
    """
    places = np.einsum("tij,tj->ti", poses[:, :3, :3], points) + poses[:, :3, 3]
    own = np.einsum("tji,tj->ti", rotations, places - tips)

    def moved(a: slice, b: slice) -> FloatArray:
        by_tip = np.einsum("tij,tj->ti", rotations[b], own[a]) + tips[b]
        by_object = np.einsum("tij,tj->ti", poses[b, :3, :3], points[a]) + poses[b, :3, 3]
        out: FloatArray = by_tip - by_object
        return out

    first, second = slice(None, -1), slice(1, None)
    slid: FloatArray = 0.5 * (moved(first, second) - moved(second, first))
    return slid
