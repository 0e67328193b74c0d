"""Where a search for a posture starts: wrist poses that nearly fit, best guesses first."""

from functools import lru_cache

import numpy as np

from graspbench.arrays import FloatArray, IntArray, cross
from graspbench.hand.directions import even_directions

TILTS_DEG = (30.0, 60.0, 85.0)
BELOW_COST = 0.15**2
PALM_ROOM_M = 0.02
CHOICES = 2
"""Choices of fingers that each direction is tried with, so that the kept starts differ."""

DENSE = 80
"""Evenly spread directions of a patient search."""


def approach_directions(
    points: FloatArray, normals: FloatArray, grounded: bool, *, dense: bool = False
) -> FloatArray:
    """List approach directions worth trying.

    Both normals of the contacts' plane; down; against the mean outward normal; tilted from above to the
    sides. With a ground, directions from below are left out.

    Args:
        points: Contact points, shape (m, 3).
        normals: Outward unit normals, shape (m, 3).
        grounded: Whether there is a ground.
        dense: Add evenly spread directions.

    Returns:
        Unit vectors, shape (d, 3).
    """
    own: list[FloatArray] = []
    gaps = points - points.mean(axis=0)
    area = cross(gaps, gaps[np.arange(len(gaps)) - len(gaps) + 1]).sum(axis=0)
    length = float(np.linalg.norm(area))
    if length > 1e-8:
        plane = -area / length if area[2] > 0.0 else area / length
        own += [plane, -plane]
    own.append(np.array([0.0, 0.0, -1.0]))
    mean = normals.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if length > 0.15:
        own.append(-mean / length)
    tilted = _tilted_directions()
    found = np.concatenate((own, tilted if grounded else np.vstack((tilted, [0.0, 0.0, 1.0]))))
    if dense:
        found = np.concatenate((found, even_directions(DENSE)))
    if grounded:
        found = found[found[:, 2] <= 0.35]
    alike = (found @ found.T > 0.985).tolist()
    kept: list[int] = []
    for i, row in enumerate(alike):
        if not any(row[j] for j in kept):
            kept.append(i)
    return np.asarray(found[kept])


@lru_cache(maxsize=1)
def _tilted_directions() -> FloatArray:
    """Return directions from above to the sides, shape (18, 3)."""
    tilt = np.repeat(np.radians(TILTS_DEG), 6)
    turn = np.tile(np.arange(6) * np.pi / 3, len(TILTS_DEG)) + tilt
    return np.column_stack((np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)))


def rank_starts(
    directions: FloatArray,
    targets: FloatArray,
    assignments: IntArray,
    tips: FloatArray,
    height: float,
    count: int,
    choices: int = CHOICES,
) -> tuple[FloatArray, IntArray]:
    """Fit the tips of the preferred posture to their targets along every direction; keep the best fits.

    For a given approach direction the best turn about it and the best shift have a closed form.

    Args:
        directions: Approach directions, unit vectors, shape (d, 3).
        targets: Wanted tip centres, shape (m, 3).
        assignments: Finger of each contact, one row a choice, shape (a, m).
        tips: Tip centres of the preferred posture, palm frame, shape (f, 3).
        height: Height of the ground; -inf for none. A palm near it is a last resort.
        count: How many starts to keep.
        choices: Choices of fingers to try along each direction.

    Returns:
        Poses of the palm frame, best first, shape (s, 3, 4), and fingers of the contacts, shape (s, m).
    """
    helper = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    x = helper - directions * np.sum(helper * directions, axis=1, keepdims=True)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    axes = np.stack([x, cross(directions, x), directions], axis=2)
    centre = targets.mean(axis=0)
    wanted = (targets - centre) @ axes
    chosen = tips[assignments]
    middle = chosen.mean(axis=1)
    offsets = chosen - middle[:, None]
    # In the plane across the direction, as complex numbers: the best turn is the phase of the product.
    planar = wanted[..., 0] + 1j * wanted[..., 1]
    turned = np.einsum("dm,am->da", planar, np.conj(offsets[..., 0] + 1j * offsets[..., 1]))
    spread = np.sum(wanted**2, axis=(1, 2))[:, None] + np.sum(offsets**2, axis=(1, 2))[None, :]
    along = np.einsum("dm,am->da", wanted[..., 2], offsets[..., 2])
    cost = (spread - 2 * along - 2 * np.abs(turned)) / len(targets)
    phase = np.where(np.abs(turned) > 1e-12, turned, 1.0)
    phase = phase / np.abs(phase)
    turn = np.zeros((*cost.shape, 3, 3))
    turn[..., 0, 0], turn[..., 0, 1] = phase.real, -phase.imag
    turn[..., 1, 0], turn[..., 1, 1] = phase.imag, phase.real
    turn[..., 2, 2] = 1.0
    rotations = axes[:, None] @ turn
    origins = centre - np.einsum("daij,aj->dai", rotations, middle)
    cost = cost + BELOW_COST * (origins[..., 2] < height + PALM_ROOM_M)
    best = np.argsort(cost, axis=1, kind="stable")[:, :choices]
    rows = np.repeat(np.arange(len(directions)), best.shape[1])
    order = np.argsort(cost[rows, best.ravel()], kind="stable")[:count]
    d, a = rows[order], best.ravel()[order]
    return np.concatenate([rotations[d, a], origins[d, a][..., None]], axis=2), assignments[a]
