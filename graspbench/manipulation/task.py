"""Secondary tasks: the interface, and what all of them share (thesis 4.4).

A new task is one small file in `graspbench.manipulation.tasks`: a frozen dataclass of its parameters,
registered under its name, with one method that gives error and Jacobian at a state.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
from graspbench.manipulation.law_arrays import new_task_blocks, task_arrays
from graspbench.manipulation.task_kernels import IN_PYTHON, evaluate_task, smooth_step
from graspbench.registry import Registry


class TaskValue(NamedTuple):
    """A task at one state.

    Attributes:
        value: f(q, eta), shape (rows,).
        jacobian: Its derivative with respect to the variables z, shape (rows, n_variables).
        error: Desired minus actual value, shape (rows,).
        activation: 0 (off) to 1 (on); one number for the task as a whole, or one a row, shape (rows,),
            for rows that come and go on their own. Has to be continuous along a motion.
    """

    value: FloatArray
    jacobian: FloatArray
    error: FloatArray
    activation: float | FloatArray = 1.0


@dataclass(frozen=True, kw_only=True)
class Task(ABC):
    """What every secondary task has."""

    priority: Annotated[int, Field(ge=0, description="Rank among the tasks, 0 is the first")] = 0
    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 5.0
    start_s: Annotated[float, Field(description="When the task enters, s")] = 0.0
    end_s: Annotated[float, Field(description="When the task begins to leave, s")] = 1e9
    ramp_s: Annotated[float, Field(gt=0, description="How long entering and leaving take, s")] = 0.5

    @abstractmethod
    def evaluate(self, state: State) -> TaskValue | None:
        """Return the task's value at ``state``, or None where it is off."""

    def presence(self, time_s: float) -> float:
        """Return how much the task takes part at a time, 0 to 1, smooth."""
        if self.start_s + self.ramp_s <= time_s <= self.end_s:
            return 1.0
        entered = smooth_step((time_s - self.start_s) / self.ramp_s)
        return entered * (1.0 - smooth_step((time_s - self.end_s) / self.ramp_s))


class PackedTask(NamedTuple):
    """A task as `task_kernels` reads it.

    Attributes:
        indices: Integers of its kind.
        numbers: Numbers of its kind.
        rows: The most rows it can have.
    """

    indices: Sequence[int]
    numbers: Sequence[float] | FloatArray
    rows: int


@dataclass(frozen=True, kw_only=True)
class CompiledTask(Task):
    """A task whose rows compiled code writes; it costs a control step next to nothing."""

    KIND: ClassVar[int]
    SEPARATE_ROWS: ClassVar[bool] = False

    @abstractmethod
    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return the task's numbers for a system.

        Raises:
            ConfigurationError: The task names joints, fingers or contacts that the system does not have.
        """

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the task's value at ``state``, or None where it is off."""
        blocks = pack_tasks([self], [self.packed(state.system)], state.system.n_variables)
        evaluate_task(*state.system.memory, state.memory, *blocks)
        arrays = task_arrays(*blocks)
        rows = slice(0, int(arrays.counts[0]))
        if rows.stop == 0:
            return None
        value, error, activation = arrays.figures[rows].T
        at_once = activation if self.SEPARATE_ROWS else float(activation[0])
        return TaskValue(value, arrays.jacobian[rows], error, at_once)


def pack_tasks(
    tasks: Sequence[Task], packed: Sequence[PackedTask], n_variables: int
) -> tuple[FloatArray, IntArray]:
    """Return the two blocks of memory of tasks, which `law_arrays.task_arrays` takes apart."""
    table, separate = np.zeros((len(tasks), 4), dtype=np.int64), np.zeros(len(tasks), dtype=np.int64)
    indices, numbers, rows = list[int](), list[float](), 0
    for t, (task, own) in enumerate(zip(tasks, packed, strict=True)):
        kind = task.KIND if isinstance(task, CompiledTask) else IN_PYTHON
        table[t] = kind, len(indices), len(numbers), rows
        separate[t] = isinstance(task, CompiledTask) and task.SEPARATE_ROWS
        indices += own.indices
        numbers += [task.gain, task.start_s, task.end_s, task.ramp_s, *own.numbers]
        rows += own.rows
    given = np.array(indices, dtype=np.int64), np.array(numbers, dtype=np.float64)
    return new_task_blocks(table, separate, *given, rows, n_variables)


TASKS: Registry[type[Task]] = Registry("task", "graspbench.manipulation.tasks")


def build_tasks(options: Mapping[str, Mapping[str, Any]]) -> dict[str, Task]:
    """Return the tasks of a configuration by name, in order of priority.

    Args:
        options: Parameters of each task; its key is the task's name, and its kind too unless it has a
            "kind" of its own (so one kind can be used twice).

    Raises:
        ConfigurationError: A kind is unknown or a parameter is wrong.
    """
    tasks: dict[str, Task] = {}
    for name, given in options.items():
        values = dict(given)
        kind = str(values.pop("kind", name))
        known = TASKS[kind].__dataclass_fields__
        unknown = sorted(set(values) - set(known))
        if unknown:
            raise ConfigurationError(
                f"task '{name}' has no option {', '.join(unknown)}",
                remedy=f"choose from {', '.join(sorted(known))}",
                task=name,
            )
        try:
            tasks[name] = TypeAdapter(TASKS[kind]).validate_python(values)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"])
            raise ConfigurationError(f"task '{name}', {where}: {first['msg']}", task=name) from error
    return dict(sorted(tasks.items(), key=lambda item: item[1].priority))


def check_members(task: str, what: str, members: Sequence[int], count: int) -> None:
    """Refuse numbers of joints, fingers or contacts that there are not.

    Raises:
        ConfigurationError: A number is out of range.
    """
    if any(not 0 <= member < count for member in members):
        raise ConfigurationError(
            f"the task {task} names {what} {', '.join(map(str, members))} but there are {count}",
            remedy=f"count from 0 to {count - 1}",
        )
