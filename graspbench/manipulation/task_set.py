"""All secondary tasks of a control law, where compiled code finds them."""

from collections.abc import Mapping, Sequence

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
from graspbench.manipulation.law_arrays import TaskArrays, task_arrays
from graspbench.manipulation.task import CompiledTask, PackedTask, Task, pack_tasks

_FIRST_ROOM = 4


class TaskSet:
    """The tasks of a law with room for their rows.

    Args:
        tasks: The tasks by name, in order of priority.
        system: The system.

    Raises:
        ConfigurationError: A task names joints, fingers or contacts that the system does not have.

    Attributes:
        names: Of the tasks.
        memory: What compiled code reads and writes.
        arrays: The arrays in it.
        in_python: Tasks whose rows compiled code cannot write, by their number.
    """

    def __init__(self, tasks: Mapping[str, Task], system: ManipulationSystem) -> None:
        self.names = tuple(tasks)
        self._tasks, self._n_variables = tuple(tasks.values()), system.n_variables
        self.in_python = {t: task for t, task in enumerate(self._tasks) if not isinstance(task, CompiledTask)}
        self._packed = [
            task.packed(system) if isinstance(task, CompiledTask) else PackedTask((), (), _FIRST_ROOM)
            for task in self._tasks
        ]
        self._lay_out()

    def evaluate_in_python(self, state: State, time_s: float) -> None:
        """Write the rows of the tasks that compiled code cannot evaluate."""
        values = {
            t: task.evaluate(state) if task.presence(time_s) > 0.0 else None
            for t, task in self.in_python.items()
        }
        for t, value in values.items():
            rows = 0 if value is None else len(value.error)
            if rows > self._packed[t].rows:
                self._packed[t] = PackedTask((), (), rows)
                self._lay_out()
        for t, value in values.items():
            first, rows = int(self.arrays.table[t, 3]), 0
            if value is not None:
                rows = len(value.error)
                own = slice(first, first + rows)
                self.arrays.figures[own, 1], self.arrays.figures[own, 2] = value.error, value.activation
                self.arrays.jacobian[own] = value.jacobian
                self.arrays.separate[t] = np.ndim(value.activation) > 0
            self.arrays.counts[t] = rows

    def jacobians(self, order: Sequence[int] | IntArray) -> list[FloatArray]:
        """Return the Jacobian of every active task's rows, first priority first."""
        blocks = []
        for t in order:
            first, count = int(self.arrays.table[t, 3]), int(self.arrays.counts[t])
            if count > 0:
                blocks.append(self.arrays.jacobian[first : first + count])
        return blocks

    def _lay_out(self) -> None:
        self.memory = pack_tasks(self._tasks, self._packed, self._n_variables)
        self.arrays: TaskArrays = task_arrays(*self.memory)
