"""A posture in which fingertips oppose each other around an object, and the palm frame that goes with it.

Postures are drawn at random. An object's centre is tried in front of many of these tips; around it every
finger takes the posture that faces it best at the wanted distance. The centre whose best two or three fingers
oppose each other best, clear of the palm, is kept.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.chains import VECTOR_OFFSET, VECTOR_RATIO
from graspbench.hand.importing.palm import palm_distance, palm_frame, palm_shapes
from graspbench.hand.model import HandModel
from graspbench.hand.verification import overlaps

_POSTURES, _CENTRES, _REFINED = 800, 200, 150
_DISTANCE_M = 0.008
_FACING, _COMFORT, _BALANCE, _PALM = 3.0, 1.2, 6.0, 4.0
_TRIED, _RESTS, _GOOD = 40, 30, -1.5
_BESIDE, _APART = 0.5, 2.0  # cosine between tips beyond which they count as beside each other
_EDGE = 0.08
_NUDGE, _FAR_FROM_SINGULAR = 1e-5, 0.025  # rad; m/rad
_ROOM_M = 0.005


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


@dataclass(frozen=True)
class _Drawn:
    """Postures drawn: joints (n, n_q), tips and pads' normals (n, f, 3), comfort (n, f)."""

    joints: FloatArray
    tips: FloatArray
    pads: FloatArray
    comfort: FloatArray


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
    shares = generator.uniform(_EDGE, 1.0 - _EDGE, (_POSTURES, hand.n_joints))
    drawn = _draw(hand, pads, shares)
    best: tuple[float, FloatArray, IntArray, tuple[int, ...], float] | None = None
    sizes = (2, 3) if hand.n_fingers > 2 else (2,)
    for gap in (gap_m, 0.7 * gap_m, 1.4 * gap_m):
        found = _search(hand, drawn, gap + hand.tip_radius_m, sizes, generator, approach)
        if best is None or found[0] > best[0] + 0.5:
            best = (*found, gap)
        if best[0] > _GOOD:
            break
    assert best is not None
    _, centre, chosen, fingers, gap = best
    joints = _combined(hand, drawn, chosen)
    if not _shared(hand):
        finer = _refined(hand, pads, joints, centre, gap + hand.tip_radius_m, generator)
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


def _draw(hand: HandModel, pads: list[FloatArray], shares: FloatArray) -> _Drawn:
    joints = hand.lower + shares * (hand.upper - hand.lower)
    n, count = len(joints), hand.n_fingers
    tips, normals, comfort = np.zeros((n, count, 3)), np.zeros((n, count, 3)), np.zeros((n, count))
    for f in range(count):
        rotations, origins = _last_frames(hand, f, joints)
        tips[:, f] = rotations @ hand.chains.tips[f] + origins
        # The compiled chains turn joint frames so that z is the axis; pads are given in Pinocchio's.
        normals[:, f] = rotations @ hand.turned(f).T @ pads[f]
        comfort[:, f] = -np.mean((2.0 * shares[:, hand.finger_joints(f)] - 1.0) ** 2, axis=1)
        comfort[:, f] -= _near_singular(hand, f, joints)
    return _Drawn(joints, tips, normals, comfort)


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


def _last_frames(hand: HandModel, f: int, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n, 3, 3) and origins (n, 3) of a finger's last joint in the palm frame."""
    chains, n = hand.chains, len(joints)
    rotations, origins = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
    for k in range(int(chains.counts[f])):
        ratio, offset = chains.limits[f, k, VECTOR_RATIO : VECTOR_OFFSET + 1]
        values = ratio * joints[:, chains.index[f, k]] + offset
        origins = origins + rotations @ chains.fixed[f, k, :, 3]
        rotations = rotations @ chains.fixed[f, k, :, :3]
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


def _shared(hand: HandModel) -> bool:
    """Tell whether a joint moves several fingers, so that their postures are not free of each other."""
    own = [set(hand.finger_joints(f).tolist()) for f in range(hand.n_fingers)]
    return any(a & b for a, b in combinations(own, 2))


def _scores(drawn: _Drawn, centre: FloatArray, distance: float) -> FloatArray:
    """Say how well each posture of each finger faces the centre at a distance, shape (n, f)."""
    towards = centre - drawn.tips
    away = np.linalg.norm(towards, axis=2)
    facing = np.sum(towards * drawn.pads, axis=2) / np.maximum(away, 1e-9)
    wrong: FloatArray = np.clip(np.abs(away - distance) / _DISTANCE_M, 0.0, 6.0)
    return np.asarray(-(wrong**2) - _FACING * (1.0 - facing) + _COMFORT * drawn.comfort)


def _search(
    hand: HandModel,
    drawn: _Drawn,
    distance: float,
    sizes: tuple[int, ...],
    generator: np.random.Generator,
    approach: FloatArray | None,
) -> tuple[float, FloatArray, IntArray, tuple[int, ...]]:
    rows = generator.integers(0, len(drawn.joints), _CENTRES)
    columns = np.arange(_CENTRES) % hand.n_fingers
    centres = drawn.tips[rows, columns] + distance * drawn.pads[rows, columns]
    shared, palm = _shared(hand), palm_shapes(hand)
    subsets = [each for size in sizes for each in combinations(range(hand.n_fingers), size)]
    lengths = np.array([len(subset) for subset in subsets])
    shares = np.array([[f in subset for f in range(hand.n_fingers)] for subset in subsets]) / lengths[:, None]
    rated: list[tuple[float, FloatArray, IntArray, tuple[int, ...]]] = []
    for centre in centres:
        scores = _scores(drawn, centre, distance)
        if shared:
            chosen = np.full(hand.n_fingers, int(scores.sum(axis=1).argmax()))
        else:
            chosen = scores.argmax(axis=0)
        every = np.arange(hand.n_fingers)
        values, tips = scores[chosen, every], drawn.tips[chosen, every]
        directions = (tips - centre) / np.maximum(np.linalg.norm(tips - centre, axis=1, keepdims=True), 1e-9)
        blocked = _PALM * max(0.0, distance + _ROOM_M - palm_distance(hand, palm, centre)) / _DISTANCE_M
        if approach is not None and centre @ approach < 0.0:
            blocked += _PALM
        imbalances = np.linalg.norm(shares @ directions, axis=1)
        # Three fingers are worth more than two, if they oppose as well.
        close = np.maximum(directions @ directions.T - _BESIDE, 0.0)
        beside = np.einsum("sf,fg,sg->s", shares > 0, close * (1.0 - np.eye(len(close))), shares > 0)
        totals = shares @ values - _BALANCE * imbalances - blocked - 0.5 * (3 - lengths) - _APART * beside
        rated += [
            (float(total), centre, chosen, subset) for total, subset in zip(totals, subsets, strict=True)
        ]
    rated.sort(key=lambda each: -each[0])
    for each in rated[:_TRIED]:
        if not overlaps(hand, _combined(hand, drawn, each[2]), fingers=each[3]):
            return each
    return rated[0]


def _combined(hand: HandModel, drawn: _Drawn, chosen: IntArray) -> FloatArray:
    joints: FloatArray = drawn.joints[int(chosen[0])].copy()
    for f in range(hand.n_fingers):
        own = hand.finger_joints(f)
        joints[own] = drawn.joints[int(chosen[f]), own]
    return joints


def _refined(
    hand: HandModel,
    pads: list[FloatArray],
    joints: FloatArray,
    centre: FloatArray,
    distance: float,
    generator: np.random.Generator,
) -> FloatArray:
    """Improve each finger's posture by itself, by smaller and smaller random changes."""
    ranges = hand.upper - hand.lower
    now = (joints - hand.lower) / ranges
    for width in (0.1, 0.03):
        tried = np.clip(now + width * generator.standard_normal((_REFINED, len(now))), _EDGE, 1.0 - _EDGE)
        tried[0] = np.clip(now, _EDGE, 1.0 - _EDGE)
        drawn = _draw(hand, pads, tried)
        chosen = _scores(drawn, centre, distance).argmax(axis=0)
        now = (_combined(hand, drawn, chosen) - hand.lower) / ranges
    return np.asarray(hand.lower + now * ranges)


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


def _rest(hand: HandModel, drawn: _Drawn, centre: FloatArray) -> FloatArray:
    """Return the posture in which every finger is farthest from the object and from the other fingers."""
    away = np.linalg.norm(drawn.tips - centre, axis=2)
    if _shared(hand):
        away = np.repeat(away.sum(axis=1, keepdims=True), hand.n_fingers, axis=1)
    order = np.argsort(-away, axis=0, kind="stable")
    for chosen in order[:_RESTS]:
        if not overlaps(hand, joints := _combined(hand, drawn, chosen)):
            return joints
    return _combined(hand, drawn, order[0])
