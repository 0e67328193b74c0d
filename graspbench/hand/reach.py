"""How far apart two fingertips of a hand can be."""

from functools import lru_cache

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.chains import LEADER, LEADER_FINGER, LOWER, OFFSET, RATIO, SLIDES, UPPER
from graspbench.hand.directions import even_directions
from graspbench.hand.model import HandModel
from graspbench.hand.shapes import FINGER, LINK, RADIUS

SAMPLES = 9
DIRECTIONS = 200


@lru_cache(maxsize=32)
def pair_limit(hand: HandModel) -> float:
    """Return a bound of the distance between two contacts that two fingertips can touch at a time, m.

    The tips' workspaces are sampled; what the samples may miss is bounded by the joints' half steps times
    the reach behind them, so the bound holds for every posture.
    """
    chains, n = hand.chains, hand.n_fingers
    directions = even_directions(DIRECTIONS)
    near, far, slack = [], [], []
    for f in range(n):
        k = int(chains.counts[f])
        count = SAMPLES if k <= 4 else 5
        joints = _sampled_joints(hand, f, count)
        heights = _sampled_tips(hand, f, joints) @ directions.T
        near.append(heights.min(axis=0))
        far.append(heights.max(axis=0))
        reach = np.array([_reach(hand, f, j) for j in range(k)])
        half_steps = (chains.limits[f, :k, UPPER] - chains.limits[f, :k, LOWER]) / (2 * (count - 1))
        slack.append(float(reach @ half_steps))
    limit = 0.0
    # The farthest pair is as far apart as the spread along its own direction; one within 0.2 rad of it
    # is among those tried.
    for f in range(n):
        for g in range(f):
            spread = max(float((far[f] - near[g]).max()), float((far[g] - near[f]).max()))
            limit = max(limit, spread / np.cos(0.2) + slack[f] + slack[g])
    return limit + 2 * hand.tip_reach_m


@lru_cache(maxsize=32)
def tip_gap(hand: HandModel) -> float:
    """Return a distance that the centres of two fingertips keep at least, or they would overlap, m.

    It is 0 where last links touch, and unless each finger's collision shapes have a ball around the centre
    of its tip.
    """
    if hand.tips_are_links:
        return 0.0
    shapes, chains = hand.shapes, hand.chains
    radii = []
    for f in range(hand.n_fingers):
        ball = (shapes.index[:, FINGER] == f) & (shapes.index[:, LINK] == chains.counts[f] - 1)
        ball &= np.all(shapes.size[:, :3] == 0.0, axis=1)
        ball &= np.all(np.abs(shapes.local[:, :, 3] - chains.tips[f]) <= 1e-9, axis=1)
        if not np.any(ball):
            return 0.0
        radii.append(float(shapes.size[ball, RADIUS].max()))
    least = sorted(radii)[:2]
    return sum(least) if len(least) == 2 else 0.0


def _sampled_joints(hand: HandModel, f: int, count: int) -> FloatArray:
    """Return a grid over the ranges of a finger's joints, shape (m, k); those that follow its own follow."""
    chains, k = hand.chains, int(hand.chains.counts[f])
    kinds, limits = chains.kinds[f, :k], chains.limits[f, :k]
    follows = (kinds[:, LEADER_FINGER] == f) & (kinds[:, LEADER] != np.arange(k))
    grids = [np.linspace(limits[j, LOWER], limits[j, UPPER], count) for j in np.flatnonzero(~follows)]
    joints = np.zeros((count ** len(grids), k))
    joints[:, ~follows] = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, len(grids))
    for j in np.flatnonzero(follows):
        joints[:, j] = limits[j, RATIO] * joints[:, kinds[j, LEADER]] + limits[j, OFFSET]
    return joints


def _sampled_tips(hand: HandModel, f: int, joints: FloatArray) -> FloatArray:
    chains = hand.chains
    tips = np.zeros((len(joints), 3))
    tips += chains.tips[f]
    for j in range(int(chains.counts[f]) - 1, -1, -1):
        if chains.kinds[f, j, SLIDES] == 1:
            slid = tips + joints[:, j, None] * [0.0, 0.0, 1.0]
            tips = slid @ chains.fixed[f, j, :, :3].T + chains.fixed[f, j, :, 3]
            continue
        c, s = np.cos(joints[:, j]), np.sin(joints[:, j])
        x, y = c * tips[:, 0] - s * tips[:, 1], s * tips[:, 0] + c * tips[:, 1]
        turned = np.column_stack([x, y, tips[:, 2]])
        tips = turned @ chains.fixed[f, j, :, :3].T + chains.fixed[f, j, :, 3]
    return tips


def _reach(hand: HandModel, f: int, joint: int) -> float:
    """Return how far a tip moves at most per unit of a joint, m/rad or m/m."""
    chains, k = hand.chains, int(hand.chains.counts[f])
    if chains.kinds[f, joint, SLIDES] == 1:
        return 1.0
    lengths = np.linalg.norm(chains.fixed[f, joint + 1 : k, :, 3], axis=1)
    slides = chains.kinds[f, joint + 1 : k, SLIDES] == 1
    travel = np.abs(chains.limits[f, joint + 1 : k, LOWER : UPPER + 1]).max(axis=1) @ slides if k else 0.0
    return float(lengths.sum() + travel + np.linalg.norm(chains.tips[f]))
