"""The controller of a name."""

from collections.abc import Callable, Sequence

from graspbench.simulation.control_parameters import ControlName
from graspbench.simulation.controllers.computed_torque import ComputedTorque
from graspbench.simulation.controllers.hybrid import HybridControl
from graspbench.simulation.controllers.object_impedance import ObjectImpedance
from graspbench.simulation.force_control import ForceControl
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch

_CONTROLLERS: dict[ControlName, Callable[[Stage, tuple[int, ...], Sequence[Touch]], ForceControl]] = {
    "joint_impedance": ForceControl,
    "object_impedance": ObjectImpedance,
    "computed_torque": ComputedTorque,
    "hybrid": HybridControl,
}


def make_control(stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> ForceControl:
    """Return the controller that ``execution.control`` names.

    Raises:
        HandError: The hand's fingers are none that it can drive.
    """
    return _CONTROLLERS[stage.parameters.control](stage, fingers, touches)
