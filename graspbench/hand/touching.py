"""The hand as it touches: where tips that have their links' real shapes are touched in a grasp."""

from dataclasses import replace

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.tip_support import FINAL_SHARPNESS_M, touching_points


def touching(hand: HandModel, posture: HandPosture, normals: FloatArray) -> HandModel:
    """Return the hand with its tips where they are touched in a grasp; one of spherical tips as it is.

    Args:
        hand: The hand.
        posture: The grasp's posture.
        normals: Outward unit normals of the object at the contacts, in the world, shape (m, 3).
    """
    if not hand.tips_are_links:
        return hand
    outwards = np.asarray(normals, dtype=float) @ posture.transform_palm_to_world[:3, :3]
    return touched(hand, np.array(posture.fingers, dtype=np.int64), hand.by_finger(posture.joints), outwards)


def touched(hand: HandModel, fingers: IntArray, rows: FloatArray, outwards: FloatArray) -> HandModel:
    """Return the hand with the tips of some fingers where planes touch them.

    Args:
        hand: The hand.
        fingers: Which fingers, shape (m,).
        rows: Joints by finger, shape (f, k).
        outwards: Unit normals of the planes, towards the fingers, palm frame, shape (m, 3).
    """
    tips = hand.chains.tips.copy()
    touching_points(
        hand.chains,
        fingers,
        np.ascontiguousarray(rows),
        np.ascontiguousarray(outwards),
        FINAL_SHARPNESS_M,
        tips,
    )
    return replace(hand, chains=hand.chains._replace(tips=tips))


def with_pads(hand: HandModel) -> HandModel:
    """Return a hand that knows the sides of its tips that touch: those towards the other fingers' tips.

    That is so in the preferred posture, in which the fingers oppose each other. Its nominal tips are the
    points of the links that reach farthest there.
    """
    tips = hand.tip_positions(hand.preferred)
    rows = hand.by_finger(hand.preferred)
    fingers = np.arange(hand.n_fingers, dtype=np.int64)
    others = np.stack([np.delete(tips, f, axis=0).mean(axis=0) for f in fingers])
    towards = others - tips
    lengths = np.linalg.norm(towards, axis=1, keepdims=True)
    towards = np.where(lengths > 1e-9, towards / np.maximum(lengths, 1e-9), [0.0, 0.0, 1.0])
    pads = np.stack([hand.last_rotation(int(f), rows).T @ towards[f] for f in fingers])
    return touched(replace(hand, chains=hand.chains._replace(pads=pads)), fingers, rows, -towards)
