"""All secondary tasks of a control law, where compiled code finds them."""

from collections.abc import Mapping, Sequence

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.compiled.step_records import TaskArrays, TaskTable
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
from graspbench.manipulation.secondary_task import CompiledTask, SecondaryTask


class TaskSet:
    """The tasks of a law with room for their rows.

    Args:
        tasks: The tasks by name, in order of priority.
        system: The system.

    Raises:
        ConfigurationError: A task names joints, fingers or contacts that the system does not have.

    Attributes:
        names: Of the tasks.
        table: What compiled code knows of them; it holds the addresses of their arrays.
        in_python: Tasks whose rows compiled code cannot write, by their number.
    """

    def __init__(self, tasks: Mapping[str, SecondaryTask], system: ManipulationSystem) -> None:
        self.names = tuple(tasks)
        self._system = system
        self.in_python = {
            t: task for t, task in enumerate(tasks.values()) if not isinstance(task, CompiledTask)
        }
        compiled = [task if isinstance(task, CompiledTask) else None for task in tasks.values()]
        self.table = TaskTable(
            kernels=[task.KERNEL.address if task else 0 for task in compiled],
            separate=[task is not None and task.SEPARATE_ROWS for task in compiled],
            blocks=np.zeros(len(compiled)),
        )
        self._arrays: list[TaskArrays] = []
        for t, (given, task) in enumerate(zip(tasks.values(), compiled, strict=True)):
            self._arrays.append(task.arrays(system) if task else self._room(given, 0))
            self.table.blocks[t] = self._arrays[t].address

    def evaluate_in_python(self, state: State, time_s: float) -> None:
        """Write the rows of the tasks that compiled code cannot evaluate."""
        for t, task in self.in_python.items():
            value = task.evaluate(state) if task.presence(time_s) > 0.0 else None
            rows = 0 if value is None else len(value.error)
            self.table.counts[t] = rows
            if value is None:
                continue
            if rows > len(self._arrays[t].errors):
                self._arrays[t] = self._room(task, rows)
                self.table.blocks[t] = self._arrays[t].address
            arrays = self._arrays[t]
            arrays.values[:rows], arrays.errors[:rows] = value.value, value.error
            arrays.activations[:rows], arrays.jacobian[:rows] = value.activation, value.jacobian
            self.table.separate[t] = np.ndim(value.activation) > 0

    def jacobians(self, order: Sequence[int] | IntArray) -> list[FloatArray]:
        """Return the Jacobian of every active task's rows, first priority first."""
        counts = self.table.counts
        return [self._arrays[t].jacobian[: counts[t]] for t in order if counts[t] > 0]

    def _room(self, task: SecondaryTask, rows: int) -> TaskArrays:
        return task.new_arrays(TaskArrays, rows, self._system.n_variables, {})
