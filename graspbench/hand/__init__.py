"""Robot hands: description, kinematics, collisions, and the check whether a hand can hold a grasp.

The names below load on first use, so that reading the configuration does not load Pinocchio.
"""

import importlib
from typing import TYPE_CHECKING, Any

from graspbench.hand.parameters import (
    CollisionShape,
    FingerDescription,
    HandParameters,
    Margins,
    PalmDescription,
)
from graspbench.hand.posture import HandPosture

if TYPE_CHECKING:
    from graspbench.hand.checker import GraspChecker
    from graspbench.hand.files import list_hands
    from graspbench.hand.kinematics import FingerSolutions
    from graspbench.hand.loading import load_hand
    from graspbench.hand.model import HandModel

__all__ = [
    "CollisionShape",
    "FingerDescription",
    "FingerSolutions",
    "GraspChecker",
    "HandModel",
    "HandParameters",
    "HandPosture",
    "Margins",
    "PalmDescription",
    "list_hands",
    "load_hand",
]

_LAZY = {
    "FingerSolutions": "kinematics",
    "GraspChecker": "checker",
    "HandModel": "model",
    "list_hands": "files",
    "load_hand": "loading",
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(f"{__name__}.{_LAZY[name]}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
