"""Whether the fingers in use can hold their tips evenly around a body: tried, as joints alone do not tell."""

import numpy as np

from graspbench.hand.checker import GraspChecker
from graspbench.hand.model import HandModel
from graspbench.hand.posture_search import CLAUSES, OBJECT

_WIDTHS = (0.7, 1.0, 1.4)
"""Widths of the bodies, as shares of the object's that the hand is read for."""


def is_better_with_two(three: HandModel, two: HandModel, width_m: float) -> bool:
    """Tell whether a hand does better with two fingers, after it was tried with three and with two.

    That a last link leans towards the body counts as reached, as planners move contacts to where it does not.
    They begin with contacts evenly around a body: a hand that reaches none of them with three fingers, as
    many that are built like a human one do not, is better off with two. So is one whose links lean into every
    body with three fingers, and into none with two.

    Args:
        three: The hand with three fingers in use.
        two: The hand with two.
        width_m: Width of the object that it is read for, m.
    """
    reasons = reasons_around(three, width_m)
    if not any(reason in ("", CLAUSES[OBJECT]) for reason in reasons):
        return True
    return not any(reason == "" for reason in reasons) and not any(reasons_around(two, width_m))


def reasons_around(hand: HandModel, width_m: float) -> list[str]:
    """Return why a hand does not reach contacts evenly around a few round bodies; empty where it does.

    Only the hand itself is in the way.

    Args:
        hand: The hand.
        width_m: Width of the object that it is read for, m.
    """
    checker, count = GraspChecker(hand, None), hand.n_fingers
    angles = 2.0 * np.pi * np.arange(count) / count
    normals = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(count)))
    return [checker.reason(0.5 * share * width_m * normals, normals) for share in _WIDTHS]
