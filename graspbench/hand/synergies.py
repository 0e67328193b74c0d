"""Postural synergies of a hand: the few directions in which its joints move together when it grasps.

People's postures while they grasp lie near a plane in the space of their joints (Santello, Flanders and
Soechting 1998); planners that move a hand in such a plane alone search few dimensions (Ciocarlie and Allen
2009: eigengrasps). A robot hand has no recorded postures. So here the postures are those with which its own
fingertips hold balls of every size, at every distance from the palm that it reaches, and the synergies are
their principal components.
"""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel

RADII = 12
"""Sizes of balls, from the smallest to as wide as the hand spans at rest."""

HEIGHTS = 9
"""Distances of balls from the palm."""

MIN_POSTURES = 12
TOLERANCE_M = 5e-4


@dataclass(frozen=True, eq=False)
class Synergies:
    """An affine subspace of joint positions.

    Attributes:
        mean: Where all amplitudes are zero, shape (n_q,), rad.
        directions: Joint positions a unit amplitude adds, shape (k, n_q), rad; a unit amplitude is one
            standard deviation of the postures.
        reach: Largest amplitude met in the postures, shape (k,).
        explained: Share of the postures' variance that each direction explains, shape (k,).
    """

    mean: FloatArray
    directions: FloatArray
    reach: FloatArray
    explained: FloatArray

    def joints(self, amplitudes: FloatArray, hand: HandModel) -> FloatArray:
        """Return the joint positions of some amplitudes, shape (k,), cut to the hand's limits, (n_q,)."""
        joints: FloatArray = np.clip(self.mean + amplitudes @ self.directions, hand.lower, hand.upper)
        return joints


def synergies(hand: HandModel, count: int) -> Synergies:
    """Return the first principal components of the postures that hold balls.

    Args:
        hand: The hand.
        count: How many at most; a hand with fewer free directions has fewer.
    """
    postures = ball_postures(hand)
    mean = postures.mean(axis=0)
    _, values, rows = np.linalg.svd(postures - mean, full_matrices=False)
    kept = min(count, int(np.count_nonzero(values > 1e-6 * max(values[0], 1e-12))))
    spread = values[:kept] / np.sqrt(len(postures))
    directions = rows[:kept] * spread[:, None]
    amplitudes = (postures - mean) @ rows[:kept].T / np.maximum(spread, 1e-12)
    return Synergies(
        mean, directions, np.abs(amplitudes).max(axis=0, initial=0.0), values[:kept] ** 2 / np.sum(values**2)
    )


def ball_postures(hand: HandModel) -> FloatArray:
    """Return joint positions with which all fingertips touch one ball, shape (n, n_q), rad.

    Each fingertip goes to where the ball is nearest to its preferred place. A hand whose fingers cannot do
    that by themselves (grippers, coupled joints) is closed and opened evenly instead.
    """
    if hand.places_by_wrist:
        return _evenly_closed(hand)
    tips = hand.tip_positions(hand.preferred)
    middle = tips.mean(axis=0)
    widest = float(np.linalg.norm(tips - middle, axis=1).max())
    radii = np.linspace(0.1, 1.3, RADII) * widest
    lifts = np.linspace(-0.6, 0.6, HEIGHTS) * widest
    centres = middle + np.array([0.0, 0.0, 1.0]) * np.repeat(lifts, RADII)[:, None]
    away = tips[None] - centres[:, None]
    away /= np.maximum(np.linalg.norm(away, axis=2, keepdims=True), 1e-9)
    targets = centres[:, None] + np.tile(radii, HEIGHTS)[:, None, None] * away
    rows = np.tile(hand.by_finger(hand.preferred), (len(targets), 1, 1))
    reached = np.ones(len(targets), dtype=np.bool_)
    for f in range(hand.n_fingers):
        count = int(hand.chains.counts[f])
        found = hand.finger_ik(f, targets[:, f], rows[0, f, :count])
        rows[:, f, :count] = found.joints
        reached &= found.error_m < TOLERANCE_M
    if np.count_nonzero(reached) < MIN_POSTURES:
        return _evenly_closed(hand)
    return np.array([hand.joint_vector(row) for row in rows[reached]])


def _evenly_closed(hand: HandModel) -> FloatArray:
    """Return postures from one limit of every joint to the other, through the preferred one."""
    shares = np.linspace(-0.9, 0.9, 2 * MIN_POSTURES + 1)[:, None]
    ends = np.where(shares < 0.0, hand.preferred - hand.lower, hand.upper - hand.preferred)
    return np.asarray(hand.preferred + shares * ends)
