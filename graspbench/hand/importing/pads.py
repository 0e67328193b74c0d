"""The sphere that follows a fingertip's pad: what is planned with, fitted to the link's real geometry."""

from dataclasses import dataclass

import numpy as np
import scipy.optimize

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.hulls import extreme_points

_PROUD_M = 1.2e-3
"""How far the sphere stands out at least: more than the margin that links keep from the object."""

_MAX_PROUD_M = 2.5e-3
"""How far it may stand out: the widest patch of directions is taken in which it does not more."""

_MIN_RADIUS_M, _MAX_RADIUS_M = 0.004, 0.015
_SLICE_M, _SLICE_SHARE = 0.012, 0.35
_RADII = (1.2, 0.9)
_EXTREME = 400
_LENGTH = 2.0
"""How much of a link is its end, in half widths; what is farther back only has to miss the object."""

_SIDES_DEG = ((60.0, 75.0), (45.0, 65.0), (30.0, 55.0), (20.0, 45.0), (12.0, 30.0))
_BACK_DEG = (-12.0, -4.0)
_PATCHES_DEG = tuple((side, back, end) for side, end in _SIDES_DEG for back in _BACK_DEG)
"""Patches of a fingertip, the widest first: to either side, towards the palm, and over the end."""


@dataclass(frozen=True)
class Pad:
    """A sphere that follows a pad.

    Attributes:
        centre: Its centre, shape (3,), m.
        radius_m: Its radius.
        proud_m: How far it stands out of the link at most, over the patch.
        patch_deg: The patch: how far a contact's normal may lean to either side, to the palm, over the end.
    """

    centre: FloatArray
    radius_m: float
    proud_m: float
    patch_deg: tuple[float, float, float]


def fit_pad(
    points: FloatArray, axes: FloatArray, radius_m: float | None = None, whose: str = "a finger"
) -> Pad:
    """Fit the sphere that touches first wherever a plane comes upon a fingertip's pad, and stands out least.

    For a direction d the link reaches to max(points . d) and the sphere to centre . d + radius. In all
    directions of a patch the latter has to be a little more; by how much at most is made as small as can be,
    which is a linear programme in the centre. Of a few radii and patches the widest patch is taken in which
    the sphere still follows the link closely.

    Args:
        points: Points on the link, shape (n, 3), m.
        axes: Unit vectors as rows: the side that closes, the direction of the tip, across both, shape (3, 3).
        radius_m: Radius to take; None for one near half the width of the link's end.
        whose: The finger, for error messages.

    Raises:
        HandError: There is no such sphere.
    """
    local = points @ axes.T
    width = _width(local)
    local = local[local[:, 1] >= local[:, 1].max() - _LENGTH * width]
    radii = [float(np.clip(share * width, _MIN_RADIUS_M, _MAX_RADIUS_M)) for share in _RADII]
    radii = [radius_m] if radius_m else radii
    local = extreme_points(local, _EXTREME)
    best: tuple[FloatArray, float, float] | None = None
    for patch in _PATCHES_DEG:
        directions = _patch_directions(patch)
        reach = (directions @ local.T).max(axis=1)
        fits = [(*_fit(directions, reach, radius), radius) for radius in radii]
        centre, proud, radius = min(fits, key=lambda fit: fit[1])
        best = centre, proud, radius
        if proud <= _MAX_PROUD_M:
            break
    assert best is not None
    centre, proud, radius = best
    if not np.isfinite(proud):
        raise HandError(
            f"no sphere follows the end of the last link of {whose}",
            remedy="check the size of its collision shapes, or say where its tip is with --tip",
        )
    return Pad(centre @ axes, round(radius, 5), proud, patch)


def _fit(directions: FloatArray, reach: FloatArray, radius: float) -> tuple[FloatArray, float]:
    """Return centre and greatest excess of the sphere that stands out least, by linear programming."""
    ones = np.ones((len(directions), 1))
    below = np.hstack((-directions, 0.0 * ones))
    above = np.hstack((directions, -ones))
    limits = np.concatenate((radius - reach - _PROUD_M, reach - radius))
    found = scipy.optimize.linprog(
        [0.0, 0.0, 0.0, 1.0], np.vstack((below, above)), limits, bounds=[(None, None)] * 4, method="highs"
    )
    if found.x is None:  # lengths far from those of a hand
        return np.zeros(3), np.inf
    solution = np.asarray(found.x, dtype=float)
    return solution[:3], float(solution[3])


def _patch_directions(patch_deg: tuple[float, float, float]) -> FloatArray:
    side, low, high = np.radians(patch_deg)
    sides, ends = np.meshgrid(np.linspace(-side, side, 5), np.linspace(low, high, 7), indexing="ij")
    return np.column_stack(
        (
            (np.cos(ends) * np.cos(sides)).ravel(),
            np.sin(ends).ravel(),
            (np.cos(ends) * np.sin(sides)).ravel(),
        )
    )


def _width(local: FloatArray) -> float:
    """Return half the smaller width of a link's end, m."""
    heights = local[:, 1]
    end = float(heights.max())
    deep = min(_SLICE_M, _SLICE_SHARE * (end - float(heights.min())))
    tip = local[heights >= end - deep]
    tip = local[heights >= end - 2.0 * deep - 1e-3] if len(tip) < 8 else tip
    return float(0.5 * min(np.ptp(tip[:, 0]), np.ptp(tip[:, 2])))
