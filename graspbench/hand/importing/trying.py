"""Whether the fingers in use can hold their tips evenly around a body: tried, as joints alone do not tell."""

import numpy as np

from graspbench.hand.checker import GraspChecker
from graspbench.hand.model import HandModel
from graspbench.hand.posture_search import CLAUSES, OBJECT

_WIDTHS = (0.7, 1.0, 1.4)
"""Widths of the bodies, as shares of the object's that the hand is read for."""


def reached_share(hand: HandModel, width_m: float) -> float:
    """Return for which share of a few round bodies a hand's fingers reach contacts evenly around them.

    Only the hand itself is in the way; that a last link leans towards the body counts as reached, as planners
    move contacts to where it does not. They begin with such grasps: a hand that reaches none of them with
    three fingers, as many that are built like a human one do not, is better off with two.

    Args:
        hand: The hand.
        width_m: Width of the object that it is read for, m.
    """
    checker, count = GraspChecker(hand, None), hand.n_fingers
    angles = 2.0 * np.pi * np.arange(count) / count
    normals = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(count)))
    reasons = [checker.reason(0.5 * share * width_m * normals, normals) for share in _WIDTHS]
    return float(np.mean([reason in ("", CLAUSES[OBJECT]) for reason in reasons]))
