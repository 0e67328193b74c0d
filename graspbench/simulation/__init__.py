"""The physical scene, its simulated camera, and what happens in it; PyBullet is used only here.

Names are imported on first use, so that reading the scene's parameters does not load PyBullet.
"""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use
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

__getattr__ = loads_on_use(__name__, _HOMES)
