"""Secondary tasks: the interface, and what all of them share (thesis 4.4).

A new task is one small file in `graspbench.manipulation.tasks`, or in another distribution under the entry
point group ``graspbench.task``: a frozen dataclass of its parameters, registered under its name. A
`SecondaryTask` gives error and Jacobian at a state in Python; a `CompiledTask` has a kernel for that
in the same file (`tasks.joint_limit` is written to be copied).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import Field, TypeAdapter, ValidationError

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.control_step import evaluate_task
from graspbench.manipulation.compiled.step_records import TaskArrays, TaskTable
from graspbench.manipulation.compiled.task_kernel import TaskKernel
from graspbench.manipulation.compiled.task_rows import smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
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
class SecondaryTask(ABC):
    """What every secondary task has.

    Attributes:
        FOLLOWS: Options that have the value of another key of the configuration unless they are given.
    """

    FOLLOWS: ClassVar[Mapping[str, str]] = {}

    priority: Annotated[int, Field(ge=0, description="Rank among the tasks, 0 is the first")] = 0
    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 5.0
    start_s: Annotated[float, Field(description="When the task enters, s")] = 0.0
    end_s: Annotated[float, Field(description="When the task begins to leave, s")] = 1e9
    ramp_s: Annotated[float, Field(gt=0, description="How long entering and leaving take, s")] = 0.5

    @abstractmethod
    def evaluate(self, state: State) -> TaskValue | None:
        """Return the task's value at ``state``, or None where it is off."""

    def new_arrays(
        self, kind: type[TaskArrays], rows: int, n_variables: int, given: Mapping[str, Any]
    ) -> TaskArrays:
        """Return memory for the task's rows, and for what else its kind has."""
        return kind(
            sizes={"rows": rows, "variables": n_variables},
            gain=self.gain,
            start_s=self.start_s,
            end_s=self.end_s,
            ramp_s=self.ramp_s,
            **given,
        )

    def presence(self, time_s: float) -> float:
        """Return how much the task takes part at a time, 0 to 1, smooth."""
        if self.start_s + self.ramp_s <= time_s <= self.end_s:
            return 1.0
        entered = smooth_step((time_s - self.start_s) / self.ramp_s)
        return entered * (1.0 - smooth_step((time_s - self.end_s) / self.ramp_s))


class PackedTask(NamedTuple):
    """A compiled task for a system.

    Attributes:
        rows: How many rows it can have at most.
        given: What its kernel reads: the fields that its own `TaskArrays` adds, by name.
    """

    rows: int
    given: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class CompiledTask(SecondaryTask):
    """A task whose rows a compiled kernel writes; it costs a control step next to nothing."""

    KERNEL: ClassVar[TaskKernel]
    SEPARATE_ROWS: ClassVar[bool] = False

    @abstractmethod
    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return what the kernel reads for a system.

        Raises:
            ConfigurationError: The task does not fit the system: it names joints, fingers or contacts that
                there are not.
        """

    def arrays(self, system: ManipulationSystem) -> TaskArrays:
        """Return the task's memory for a system."""
        rows, given = self.packed(system)
        return self.new_arrays(self.KERNEL.arrays, rows, system.n_variables, given)

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the task's value at ``state``, or None where it is off."""
        arrays = self.arrays(state.system)
        table = TaskTable(
            kernels=[self.KERNEL.address], blocks=[arrays.address], separate=[self.SEPARATE_ROWS]
        )
        evaluate_task(state.system.arrays.block, state.block, table.block, 0)
        count = int(table.counts[0])
        if count == 0:
            return None
        activation = arrays.activations[:count] if self.SEPARATE_ROWS else float(arrays.activations[0])
        return TaskValue(arrays.values[:count], arrays.jacobian[:count], arrays.errors[:count], activation)


TASKS: Registry[type[SecondaryTask]] = Registry("task", "graspbench.manipulation.tasks")


def build_tasks(options: Mapping[str, Mapping[str, Any]]) -> dict[str, SecondaryTask]:
    """Return the tasks of a configuration by name, in order of priority.

    Args:
        options: Parameters of each task; its key is the task's name, and its kind too unless it has a
            "kind" of its own (so one kind can be used twice).

    Raises:
        ConfigurationError: A kind is unknown or a parameter is wrong.
    """
    tasks: dict[str, SecondaryTask] = {}
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
