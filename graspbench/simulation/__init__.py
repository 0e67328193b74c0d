"""The physical scene, its simulated camera, and what happens in it; PyBullet is used only here.

Names are imported on first use, so that reading the scene's parameters does not load PyBullet.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.execution_result import ExecutionResult
from graspbench.simulation.scene import SceneParameters

if TYPE_CHECKING:
    from graspbench.simulation.capture import EyeInHand
    from graspbench.simulation.world import World

__all__ = [
    "ExecutionParameters",
    "ExecutionResult",
    "EyeInHand",
    "SceneParameters",
    "World",
]

_HOMES = {"EyeInHand": "capture", "World": "world"}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
