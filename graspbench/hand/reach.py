"""How far apart two fingertips of a hand can be."""

from functools import lru_cache

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.chains import LOWER, UPPER
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
        grids = [np.linspace(chains.limits[f, j, LOWER], chains.limits[f, j, UPPER], count) for j in range(k)]
        joints = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, k)
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
    return limit + 2 * hand.tip_radius_m


@lru_cache(maxsize=32)
def tip_gap(hand: HandModel) -> float:
    """Return a distance that the centres of two fingertips keep at least, or they would overlap, m.

    It is 0 unless each finger's collision shapes have a ball around the centre of its tip.
    """
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


def _sampled_tips(hand: HandModel, f: int, joints: FloatArray) -> FloatArray:
    chains = hand.chains
    tips = np.zeros((len(joints), 3))
    tips += chains.tips[f]
    for j in range(int(chains.counts[f]) - 1, -1, -1):
        c, s = np.cos(joints[:, j]), np.sin(joints[:, j])
        x, y = c * tips[:, 0] - s * tips[:, 1], s * tips[:, 0] + c * tips[:, 1]
        turned = np.column_stack([x, y, tips[:, 2]])
        tips = turned @ chains.fixed[f, j, :, :3].T + chains.fixed[f, j, :, 3]
    return tips


def _reach(hand: HandModel, f: int, joint: int) -> float:
    chains = hand.chains
    lengths = np.linalg.norm(chains.fixed[f, joint + 1 : int(chains.counts[f]), :, 3], axis=1)
    return float(lengths.sum() + np.linalg.norm(chains.tips[f]))


def even_directions(count: int) -> FloatArray:
    """Return unit vectors spread evenly over the sphere (a Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count)
    z = 1 - 2 * (i + 0.5) / count
    angle = i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
