"""Which mount carries the hand in an execution."""

from graspbench.hand.model import HandModel
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.mounts.arm import ArmMount
from graspbench.simulation.mounts.arm_placement import Placement
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.mounts.mount import Mount, PalmTask

Carrier = ArmParameters | Placement


def make_mount(carrier: Carrier, hand: HandModel, task: PalmTask) -> Mount:
    """Return a mount at the start of a task.

    Args:
        carrier: What carries the hand: an arm, placed already or to be placed, or a floating wrist where no
            URDF is named.
        hand: The hand.
        task: What the palm has to do.

    Raises:
        HandError: The arm cannot be read.
        SimulationError: The mount can do the task from no place beside the object.
    """
    if isinstance(carrier, Placement):
        return ArmMount(hand, carrier)
    if carrier.urdf is None:
        return FloatingWrist.for_task(hand, task)
    return ArmMount.for_task(carrier, hand, task)
