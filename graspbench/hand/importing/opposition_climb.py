"""A posture that opposes better than those that were drawn: centre and joints moved together.

Fingers with wide ranges, or long ones, are hit by random postures so rarely that none faces an object well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.hulls import extreme_points
from graspbench.hand.importing.drawing import (
    APART,
    BALANCE,
    BESIDE,
    DISTANCE_M,
    OVERLAP,
    PALM,
    ROOM_M,
    Drawn,
    Limits,
    draw,
    facing_scores,
)
from graspbench.hand.importing.palm import palm_cloud, palm_distance, palm_shapes
from graspbench.hand.model import HandModel
from graspbench.hand.verification import overlaps

_ROUNDS = (0.25, 0.15, 0.1, 0.06, 0.04, 0.02)
"""Widths of the changes, as shares of the joints' ranges."""

_DRAWN, _CENTRE_M = 150, 0.06
_OVER, _LEVEL_M, _EXTREME = 0.6, 0.01, 100
_CHECKED = 5
_BENT, _ONE_WAY, _CLIMBS = (0.03, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45), 2.0, 4


@dataclass(frozen=True)
class Seed:
    """Where a climb begins.

    Attributes:
        joints: Joint positions, shape (n_q,).
        centre: Centre of the object, shape (3,), m.
        fingers: The fingers that oppose.
        distance_m: Wanted distance of the tips' centres from there.
    """

    joints: FloatArray
    centre: FloatArray
    fingers: tuple[int, ...]
    distance_m: float


def bent_together(
    hand: HandModel,
    pads: list[FloatArray],
    limits: Limits,
    subsets: Sequence[tuple[int, ...]],
    distance_m: float,
) -> list[Seed]:
    """Return postures in which all joints are bent by the same share of their ranges, from straight ones.

    Joints that bend either way alike stay in their middle.
    """
    lower, upper = limits
    one_way = np.maximum(np.abs(lower), np.abs(upper)) > _ONE_WAY * np.minimum(np.abs(lower), np.abs(upper))
    seeds = []
    for share in _BENT:
        at = np.where(np.abs(lower) <= np.abs(upper), share, 1.0 - share)
        drawn = draw(hand, pads, np.where(one_way, at, 0.5)[None], limits)
        for subset in subsets:
            seeds.append(Seed(drawn.joints[0], drawn.tips[0, list(subset)].mean(axis=0), subset, distance_m))
    return seeds


def best_climb(
    hand: HandModel,
    pads: list[FloatArray],
    limits: Limits,
    seeds: Sequence[Seed],
    generator: np.random.Generator,
    approach: FloatArray | None,
) -> tuple[FloatArray, FloatArray, tuple[int, ...]]:
    """Climb from the most promising of some seeds; return joints, centre and fingers of the best end."""
    lower, ranges = limits[0], limits[1] - limits[0]
    palm, rated = _Palm.of(hand, approach), []
    for k, seed in enumerate(seeds):
        drawn = draw(hand, pads, ((seed.joints - lower) / ranges)[None], limits)
        rated.append((-_total(hand, drawn, 0, seed.centre, seed, palm), k))
    ends = []
    for _, k in sorted(rated)[:_CLIMBS]:
        total, joints, centre = climb(hand, pads, limits, seeds[k], generator, approach)
        ends.append((total, -k, joints, centre, seeds[k].fingers))
    _, _, joints, centre, fingers = max(ends, key=lambda end: end[:2])
    return joints, centre, fingers


def climb(
    hand: HandModel,
    pads: list[FloatArray],
    limits: Limits,
    seed: Seed,
    generator: np.random.Generator,
    approach: FloatArray | None,
) -> tuple[float, FloatArray, FloatArray]:
    """Move joints and centre by smaller and smaller random changes.

    Besides what `graspbench.hand.importing.opposition` looks at, knuckles and palm have to stay on the palm's
    side of the tips, as far as the object is concerned, and fingers out of each other.

    Args:
        hand: The hand.
        pads: Side of each last link that closes, last joint's frame, shape (3,).
        limits: The joints' usual limits.
        seed: Where to begin.
        generator: Source of the changes.
        approach: Direction from the palm to the object; None to find it.

    Returns:
        How well the posture opposes, the joints, shape (n_q,), and the centre, shape (3,).
    """
    lower, ranges = limits[0], limits[1] - limits[0]
    surroundings = _Palm.of(hand, approach)
    now, centre = np.clip((seed.joints - lower) / ranges, 0.0, 1.0), seed.centre
    best = -np.inf
    for width in _ROUNDS:
        shares = np.clip(now + width * generator.standard_normal((_DRAWN, len(now))), 0.02, 0.98)
        centres = centre + width * _CENTRE_M * generator.standard_normal((_DRAWN, 3))
        shares[0], centres[0] = now, centre
        # Half of them change one finger only.
        for row in range(1, _DRAWN, 2):
            kept = np.ones(len(now), dtype=bool)
            kept[hand.finger_joints(seed.fingers[row // 2 % len(seed.fingers)])] = False
            shares[row, kept] = now[kept]
        drawn = draw(hand, pads, shares, limits)
        totals = np.array(
            [_total(hand, drawn, row, centres[row], seed, surroundings) for row in range(_DRAWN)]
        )
        for row in np.argsort(-totals, kind="stable")[:_CHECKED]:
            total = totals[row] - OVERLAP * bool(overlaps(hand, drawn.joints[row], fingers=seed.fingers))
            if total > best or row == 0:
                best, now, centre = max(best, float(total)), shares[row], centres[row]
                break
    return best, lower + now * ranges, centre


@dataclass(frozen=True)
class _Palm:
    """What of the hand does not move.

    Attributes:
        cloud: Points on the palm's shapes, shape (p, 3).
        base: Mean place of the fingers' first joints, shape (3,).
        approach: Direction from the palm to the object, if it is known.
    """

    cloud: FloatArray
    base: FloatArray
    approach: FloatArray | None

    @staticmethod
    def of(hand: HandModel, approach: FloatArray | None) -> "_Palm":
        base = np.array([hand.chains.fixed[f, 0, :, 3] for f in range(hand.n_fingers)]).mean(axis=0)
        cloud = palm_cloud(hand)
        cloud = extreme_points(cloud, _EXTREME) if len(cloud) > _EXTREME else np.vstack((cloud, base))
        return _Palm(cloud, base, approach)


def _total(hand: HandModel, drawn: Drawn, row: int, centre: FloatArray, seed: Seed, palm: _Palm) -> float:
    """Say how well the fingers of one posture oppose each other around a centre."""
    own = list(seed.fingers)
    one = Drawn(*(part[row : row + 1] for part in drawn))
    values, tips = facing_scores(one, centre, seed.distance_m)[0, own], drawn.tips[row, own]
    directions = (tips - centre) / np.maximum(np.linalg.norm(tips - centre, axis=1, keepdims=True), 1e-9)
    imbalance = float(np.linalg.norm(directions.mean(axis=0)))
    close = np.maximum(directions @ directions.T - BESIDE, 0.0)
    beside = float(close.sum() - np.trace(close))
    room = palm_distance(hand, palm_shapes(hand), centre)
    blocked = PALM * max(0.0, seed.distance_m + ROOM_M - room) / DISTANCE_M
    if palm.approach is not None and centre @ palm.approach < 0.0:
        blocked += PALM
    beyond = beyond_tips(tips, drawn.knuckles[row, own], palm.cloud, centre, centre - palm.base)
    over = _OVER * max(0.0, beyond - _LEVEL_M) / DISTANCE_M
    return float(values.mean()) - BALANCE * imbalance - APART * beside - blocked - over - 0.5 * (3 - len(own))


def beyond_tips(
    tips: FloatArray, knuckles: FloatArray, palm: FloatArray, centre: FloatArray, away: FloatArray
) -> float:
    """Return how far knuckles of two or three fingers, or the palm, are beyond the tips' plane, m.

    What is there meets the ground, or what the object lies on, before the tips are at the object.

    Args:
        tips: Shape (f, 3).
        knuckles: Origins of the joints, shape (f, k, 3).
        palm: Points on the palm, shape (p, 3).
        centre: Centre of the object, shape (3,).
        away: From the palm to there, shape (3,).
    """
    if len(tips) == 2:
        line = tips[1] - tips[0]
        z = away - (away @ line) / max(float(line @ line), 1e-12) * line
    else:
        z = np.cross(tips[1] - tips[0], tips[2] - tips[0])
        z = z if z @ away >= 0.0 else -z
    length = float(np.linalg.norm(z))
    if length < 1e-9:
        return 0.0
    farthest = max(float((knuckles @ z).max()), float((palm @ z).max()))
    return (farthest - float(centre @ z)) / length
