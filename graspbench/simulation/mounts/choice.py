"""Which mount carries the hand in an execution."""

from collections.abc import Callable, Mapping

from graspbench.hand.model import HandModel
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.mounts.kuka import KukaMount
from graspbench.simulation.mounts.mount import Mount, PalmTask

MOUNTS: Mapping[str, Callable[[HandModel, PalmTask], Mount]] = {
    "floating": FloatingWrist.for_task,
    "kuka": KukaMount.for_task,
}


def make_mount(name: str, hand: HandModel, task: PalmTask) -> Mount:
    """Return a mount at the start of a task.

    Args:
        name: As in ``execution.mount``.
        hand: The hand.
        task: What the palm has to do.

    Raises:
        SimulationError: The mount can do the task from no place beside the object.
    """
    return MOUNTS[name](hand, task)
