"""The part of a joint's range that a finger is used in: files often state more than the real one has."""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray

WIDE_DEG = 170.0
"""Few fingers' joints turn so far; some published files state such limits for want of the real ones."""

_ROUND_DEG, _NEAR_DEG = 90.0, 0.5
_USUAL_RAD = np.radians(110.0)


def unmeasured(lower: FloatArray, upper: FloatArray, turns: BoolArray) -> BoolArray:
    """Tell which joints' limits nobody has measured: half a turn or so between multiples of 90 degrees.

    Args:
        lower: Limits, shape (n,), rad or m.
        upper: Likewise.
        turns: Which of the joints turn, shape (n,).
    """
    degrees = np.degrees(np.stack((lower, upper)))
    is_round = (np.abs(degrees - _ROUND_DEG * np.round(degrees / _ROUND_DEG)) < _NEAR_DEG).all(axis=0)
    return np.asarray(turns & is_round & (degrees[1] - degrees[0] >= WIDE_DEG))


def usual_range(lower: FloatArray, upper: FloatArray, turns: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the limits of joints, unmeasured ones drawn in to 110 degrees as near to 0 as can be.

    At 0 most descriptions have the finger straight.

    Args:
        lower: Limits, shape (n,), rad or m.
        upper: Likewise.
        turns: Which of the joints turn, shape (n,).
    """
    wide = unmeasured(lower, upper, turns)
    half = 0.5 * np.where(wide, _USUAL_RAD, upper - lower)
    middle = np.where(wide, np.clip(0.0, lower + half, upper - half), 0.5 * (lower + upper))
    return np.where(wide, middle - half, lower), np.where(wide, middle + half, upper)
