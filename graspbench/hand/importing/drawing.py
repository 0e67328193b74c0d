"""Postures of a hand drawn at random, and how well each finger's tip faces an object's centre in them."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.chains import VECTOR_OFFSET, VECTOR_RATIO
from graspbench.hand.importing.ranges import usual_range
from graspbench.hand.model import HandModel

DISTANCE_M = 0.008
"""Distance of a tip from where it should be that costs one point."""

BALANCE, PALM, APART, OVERLAP = 6.0, 4.0, 2.0, 4.0
BESIDE = 0.5
"""Cosine between tips beyond which they count as beside each other."""

ROOM_M = 0.005
"""Between the object and the palm."""

_FACING, _COMFORT = 3.0, 1.2
_NUDGE, _FAR_FROM_SINGULAR = 1e-5, 0.025  # rad; m/rad
Limits = tuple[FloatArray, FloatArray]


class Drawn(NamedTuple):
    """Postures drawn: joints (n, n_q), tips and pads (n, f, 3), comfort (n, f), knuckles (n, f, k, 3)."""

    joints: FloatArray
    tips: FloatArray
    pads: FloatArray
    comfort: FloatArray
    knuckles: FloatArray


def usual_limits(hand: HandModel) -> Limits:
    """Return the joints' limits, those of wide ones drawn in (see `usual_range`)."""
    turns = np.ones(hand.n_joints, dtype=bool)
    for f in range(hand.n_fingers):
        for k in range(int(hand.chains.counts[f])):
            turns[hand.chains.index[f, k]] &= not hand.slides(f, k)
    return usual_range(hand.lower, hand.upper, turns)


def draw(hand: HandModel, pads: list[FloatArray], shares: FloatArray, limits: Limits) -> Drawn:
    """Return postures at shares of the joints' ranges, shape (n, n_q)."""
    joints = limits[0] + shares * (limits[1] - limits[0])
    # The middle of a range that nobody measured is no better than the rest of it.
    wide = (limits[0] != hand.lower) | (limits[1] != hand.upper)
    n, count = len(joints), hand.n_fingers
    tips, normals, comfort = np.zeros((n, count, 3)), np.zeros((n, count, 3)), np.zeros((n, count))
    knuckles = np.zeros((n, count, hand.chains.fixed.shape[1], 3))
    for f in range(count):
        rotations, origins = _last_frames(hand, f, joints, knuckles[:, f])
        tips[:, f] = rotations @ hand.chains.tips[f] + origins
        # The compiled chains turn joint frames so that z is the axis; pads are given in Pinocchio's.
        normals[:, f] = rotations @ hand.turned(f).T @ pads[f]
        own = hand.finger_joints(f)
        comfort[:, f] = -np.mean(np.where(wide[own], 0.0, 2.0 * shares[:, own] - 1.0) ** 2, axis=1)
        comfort[:, f] -= _near_singular(hand, f, joints)
    return Drawn(joints, tips, normals, comfort, knuckles)


def _near_singular(hand: HandModel, f: int, joints: FloatArray) -> FloatArray:
    """Return how near each posture of a finger is to a singularity, 0 (not at all) to 1, shape (n,)."""
    columns = []
    for i in hand.finger_joints(f):
        ends = []
        for step in (-_NUDGE, _NUDGE):
            moved = joints.copy()
            moved[:, i] += step
            rotations, origins = _last_frames(hand, f, moved)
            ends.append(rotations @ hand.chains.tips[f] + origins)
        columns.append((ends[1] - ends[0]) / (2 * _NUDGE))
    values = np.linalg.svd(np.stack(columns, axis=2), compute_uv=False)[:, hand.freedom[f] - 1]
    return np.asarray(1.0 - np.minimum(values / _FAR_FROM_SINGULAR, 1.0))


def _last_frames(
    hand: HandModel, f: int, joints: FloatArray, knuckles: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, 3, 3) and origins (n, 3) of a finger's last joint in the palm frame.

    The origins of all its joints go to ``knuckles``, shape (n, k, 3), the last again where there are fewer.
    """
    chains, n = hand.chains, len(joints)
    rotations, origins = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
    for k in range(int(chains.counts[f])):
        ratio, offset = chains.limits[f, k, VECTOR_RATIO : VECTOR_OFFSET + 1]
        values = ratio * joints[:, chains.index[f, k]] + offset
        origins = origins + rotations @ chains.fixed[f, k, :, 3]
        rotations = rotations @ chains.fixed[f, k, :, :3]
        if knuckles is not None:
            knuckles[:, k:] = origins[:, None]
        if hand.slides(f, k):
            origins = origins + values[:, None] * rotations[:, :, 2]
            continue
        turn = np.zeros((n, 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(values)
        turn[:, 1, 0] = np.sin(values)
        turn[:, 0, 1] = -turn[:, 1, 0]
        turn[:, 2, 2] = 1.0
        rotations = rotations @ turn
    return rotations, origins


def is_shared(hand: HandModel) -> bool:
    """Tell whether a joint moves several fingers, so that their postures are not free of each other."""
    own = [set(hand.finger_joints(f).tolist()) for f in range(hand.n_fingers)]
    return any(a & b for a, b in combinations(own, 2))


def facing_scores(drawn: Drawn, centre: FloatArray, distance: float) -> FloatArray:
    """Say how well each posture of each finger faces the centre at a distance, shape (n, f)."""
    towards = centre - drawn.tips
    away = np.linalg.norm(towards, axis=2)
    facing = np.sum(towards * drawn.pads, axis=2) / np.maximum(away, 1e-9)
    wrong: FloatArray = np.clip(np.abs(away - distance) / DISTANCE_M, 0.0, 6.0)
    return np.asarray(-(wrong**2) - _FACING * (1.0 - facing) + _COMFORT * drawn.comfort)


def combined(hand: HandModel, drawn: Drawn, chosen: IntArray) -> FloatArray:
    """Return joints, shape (n_q,), in which each finger is as in the posture that was chosen for it."""
    joints: FloatArray = drawn.joints[int(chosen[0])].copy()
    for f in range(hand.n_fingers):
        own = hand.finger_joints(f)
        joints[own] = drawn.joints[int(chosen[f]), own]
    return joints
