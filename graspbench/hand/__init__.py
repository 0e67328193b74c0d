"""Robot hands: description, kinematics, collisions, and the check whether a hand can hold a grasp.

The names below load on first use, so that reading the configuration does not load Pinocchio.
"""

from typing import TYPE_CHECKING

from graspbench.hand.parameters import (
    CollisionShape,
    FingerDescription,
    HandParameters,
    Margins,
    PalmDescription,
)
from graspbench.hand.posture import HandPosture
from graspbench.lazy import loads_on_use

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

_HOMES = {
    "FingerSolutions": "kinematics",
    "GraspChecker": "checker",
    "HandModel": "model",
    "list_hands": "files",
    "load_hand": "loading",
}

__getattr__ = loads_on_use(__name__, _HOMES)
