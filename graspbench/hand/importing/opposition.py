"""A posture in which fingertips oppose each other around an object, and the palm frame that goes with it.

Postures are drawn at random. An object's centre is tried in front of many of these tips; around it every
finger takes the posture that faces it best at the wanted distance. The centre whose best two or three fingers
oppose each other best, clear of the palm, is kept.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.importing.drawing import (
    APART,
    BALANCE,
    BESIDE,
    DISTANCE_M,
    PALM,
    ROOM_M,
    Drawn,
    Limits,
    combined,
    draw,
    facing_scores,
    is_shared,
    usual_limits,
)
from graspbench.hand.importing.opposition_climb import Seed, bent_together, best_climb
from graspbench.hand.importing.palm import palm_distance, palm_frame, palm_shapes
from graspbench.hand.model import HandModel
from graspbench.hand.verification import overlaps

_POSTURES, _CENTRES, _REFINED = 800, 200, 150
_TRIED, _RESTS, _GOOD = 40, 30, -1.5
_EDGE = 0.08
_Rated = tuple[float, FloatArray, IntArray, tuple[int, ...]]
"""Points (or a distance), the centre, the posture of each finger, and the fingers that oppose."""


@dataclass(frozen=True)
class Opposition:
    """How a hand opposes.

    Attributes:
        joints: Posture in which all fingers close around the centre, shape (n_q,).
        rest: Posture in which they are out of the way, shape (n_q,).
        subsets: The fingers that oppose best, by their number.
        centre: Centre of the object, palm link's frame, shape (3,), m.
        transform_palm_to_link: The palm frame: z towards the object, shape (4, 4).
        gap_m: Distance of the centre from the tips' surfaces.
        imbalance: Length of the mean direction from centre to tips, 0 where they oppose perfectly.
    """

    joints: FloatArray
    rest: FloatArray
    subsets: dict[int, tuple[int, ...]]
    centre: FloatArray
    transform_palm_to_link: FloatArray
    gap_m: float
    imbalance: float


def find_opposition(
    hand: HandModel, pads: list[FloatArray], gap_m: float, approach: FloatArray | None = None
) -> Opposition:
    """Find how the fingers of a hand oppose each other.

    Args:
        hand: The hand with all its fingers, its palm frame still that of the palm link.
        pads: Side of each last link that closes, last joint's frame, shape (3,).
        gap_m: Half the width of the object that the posture is for.
        approach: Direction from the palm to the object in the palm link's frame; None to find it.
    """
    generator = np.random.default_rng(0)
    limits = usual_limits(hand)
    shares = generator.uniform(_EDGE, 1.0 - _EDGE, (_POSTURES, hand.n_joints))
    drawn = draw(hand, pads, shares, limits)
    best: tuple[float, FloatArray, IntArray, tuple[int, ...], float] | None = None
    weak: list[_Rated] = []
    sizes = (2, 3) if hand.n_fingers > 2 else (2,)
    for gap in (gap_m, 0.7 * gap_m, 1.4 * gap_m):
        found, by_size = _search(hand, drawn, gap + hand.tip_radius_m, sizes, generator, approach)
        weak += [(gap + hand.tip_radius_m, *each[1:]) for each in by_size]
        if best is None or found[0] > best[0] + 0.5:
            best = (*found, gap)
        if best[0] > _GOOD:
            break
    assert best is not None
    _, centre, chosen, fingers, gap = best
    joints = combined(hand, drawn, chosen)
    guessed = not (np.array_equal(limits[0], hand.lower) and np.array_equal(limits[1], hand.upper))
    poor = best[0] <= _GOOD or bool(overlaps(hand, joints, fingers=fingers))
    if guessed and poor and not is_shared(hand):
        joints, centre, fingers = _climbed(hand, pads, limits, drawn, weak, generator, approach)
    elif not is_shared(hand):
        finer = _refined(hand, pads, joints, centre, gap + hand.tip_radius_m, generator, limits)
        if not overlaps(hand, finer, fingers=fingers) or overlaps(hand, joints, fingers=fingers):
            joints = finer
    tips = hand.tip_positions(joints)
    directions = (tips - centre) / np.maximum(np.linalg.norm(tips - centre, axis=1, keepdims=True), 1e-9)
    subsets = _subsets(hand, directions, fingers)
    return Opposition(
        joints=joints,
        rest=_rest(hand, drawn, centre),
        subsets=subsets,
        centre=centre,
        transform_palm_to_link=palm_frame(hand, centre, tips[list(fingers)], approach),
        gap_m=float(np.linalg.norm(tips[list(fingers)] - centre, axis=1).mean() - hand.tip_radius_m),
        imbalance=float(np.linalg.norm(directions[list(fingers)].mean(axis=0))),
    )


def _search(
    hand: HandModel,
    drawn: Drawn,
    distance: float,
    sizes: tuple[int, ...],
    generator: np.random.Generator,
    approach: FloatArray | None,
) -> tuple[_Rated, list[_Rated]]:
    """Return the best opposition, and the best of each number of fingers."""
    rows = generator.integers(0, len(drawn.joints), _CENTRES)
    columns = np.arange(_CENTRES) % hand.n_fingers
    centres = drawn.tips[rows, columns] + distance * drawn.pads[rows, columns]
    shared, palm = is_shared(hand), palm_shapes(hand)
    subsets = [each for size in sizes for each in combinations(range(hand.n_fingers), size)]
    lengths = np.array([len(subset) for subset in subsets])
    shares = np.array([[f in subset for f in range(hand.n_fingers)] for subset in subsets]) / lengths[:, None]
    rated: list[_Rated] = []
    for centre in centres:
        scores = facing_scores(drawn, centre, distance)
        if shared:
            chosen = np.full(hand.n_fingers, int(scores.sum(axis=1).argmax()))
        else:
            chosen = scores.argmax(axis=0)
        every = np.arange(hand.n_fingers)
        values, tips = scores[chosen, every], drawn.tips[chosen, every]
        directions = (tips - centre) / np.maximum(np.linalg.norm(tips - centre, axis=1, keepdims=True), 1e-9)
        blocked = PALM * max(0.0, distance + ROOM_M - palm_distance(hand, palm, centre)) / DISTANCE_M
        if approach is not None and centre @ approach < 0.0:
            blocked += PALM
        imbalances = np.linalg.norm(shares @ directions, axis=1)
        # Three fingers are worth more than two, if they oppose as well.
        close = np.maximum(directions @ directions.T - BESIDE, 0.0)
        beside = np.einsum("sf,fg,sg->s", shares > 0, close * (1.0 - np.eye(len(close))), shares > 0)
        totals = shares @ values - BALANCE * imbalances - blocked - 0.5 * (3 - lengths) - APART * beside
        rated += [
            (float(total), centre, chosen, subset) for total, subset in zip(totals, subsets, strict=True)
        ]
    rated.sort(key=lambda each: -each[0])
    by_size = [next(each for each in rated if len(each[3]) == size) for size in sizes]
    for each in rated[:_TRIED]:
        if not overlaps(hand, combined(hand, drawn, each[2]), fingers=each[3]):
            return each, by_size
    return rated[0], by_size


def _climbed(
    hand: HandModel,
    pads: list[FloatArray],
    limits: Limits,
    drawn: Drawn,
    weak: list[_Rated],
    generator: np.random.Generator,
    approach: FloatArray | None,
) -> tuple[FloatArray, FloatArray, tuple[int, ...]]:
    """Return joints, centre and fingers of the best opposition that is found by climbing from weak ones."""
    seeds = [
        Seed(combined(hand, drawn, chosen), centre, fingers, distance)
        for distance, centre, chosen, fingers in weak
    ]
    subsets = list(dict.fromkeys(seed.fingers for seed in seeds))
    for distance in dict.fromkeys(seed.distance_m for seed in seeds):
        seeds += bent_together(hand, pads, limits, subsets, distance)
    joints, centre, fingers = best_climb(hand, pads, limits, seeds, generator, approach)
    return _with_others(hand, drawn, joints, centre, fingers), centre, fingers


def _with_others(
    hand: HandModel, drawn: Drawn, joints: FloatArray, centre: FloatArray, fingers: tuple[int, ...]
) -> FloatArray:
    """Return a posture whose other fingers face the centre too, as well as they can without overlaps."""
    distance = float(np.linalg.norm(hand.tip_positions(joints)[list(fingers)] - centre, axis=1).mean())
    scores, placed = facing_scores(drawn, centre, distance), list(fingers)
    for f in (f for f in range(hand.n_fingers) if f not in fingers):
        own = hand.finger_joints(f)
        order = np.argsort(-scores[:, f], kind="stable")[:_TRIED]
        tried = [joints.copy() for _ in order]
        for each, row in zip(tried, order, strict=True):
            each[own] = drawn.joints[row, own]
        placed.append(f)
        fitting = (each for each in tried if not overlaps(hand, each, fingers=tuple(placed)))
        joints = next(fitting, tried[0])
    return joints


def _refined(
    hand: HandModel,
    pads: list[FloatArray],
    joints: FloatArray,
    centre: FloatArray,
    distance: float,
    generator: np.random.Generator,
    limits: Limits,
) -> FloatArray:
    """Improve each finger's posture by itself, by smaller and smaller random changes."""
    lower, ranges = limits[0], limits[1] - limits[0]
    now = (joints - lower) / ranges
    for width in (0.1, 0.03):
        tried = np.clip(now + width * generator.standard_normal((_REFINED, len(now))), _EDGE, 1.0 - _EDGE)
        tried[0] = np.clip(now, _EDGE, 1.0 - _EDGE)
        drawn = draw(hand, pads, tried, limits)
        chosen = facing_scores(drawn, centre, distance).argmax(axis=0)
        now = (combined(hand, drawn, chosen) - lower) / ranges
    return np.asarray(lower + now * ranges)


def _subsets(hand: HandModel, directions: FloatArray, best: tuple[int, ...]) -> dict[int, tuple[int, ...]]:
    """Return for each number of fingers those that oppose best; the one against the others comes first."""
    found = {}
    for size in range(2, hand.n_fingers + 1):
        sets = list(combinations(range(hand.n_fingers), size))
        chosen = (
            best
            if size == len(best)
            else min(sets, key=lambda each: float(np.linalg.norm(directions[list(each)].mean(axis=0))))
        )
        against = [float(sum(directions[f] @ directions[g] for g in chosen if g != f)) for f in chosen]
        first = chosen[int(np.argmin(against))]
        found[size] = (first, *(f for f in chosen if f != first))
    return found


def _rest(hand: HandModel, drawn: Drawn, centre: FloatArray) -> FloatArray:
    """Return the posture in which every finger is farthest from the object and from the other fingers."""
    away = np.linalg.norm(drawn.tips - centre, axis=2)
    if is_shared(hand):
        away = np.repeat(away.sum(axis=1, keepdims=True), hand.n_fingers, axis=1)
    order = np.argsort(-away, axis=0, kind="stable")
    for chosen in order[:_RESTS]:
        if not overlaps(hand, joints := combined(hand, drawn, chosen)):
            return joints
    return combined(hand, drawn, order[0])
