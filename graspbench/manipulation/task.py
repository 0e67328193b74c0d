"""Secondary tasks: the interface, and what all of them share (thesis 4.4).

A new task is one small file in `graspbench.manipulation.tasks`: a frozen dataclass of its parameters,
registered under its name, with one method that gives error and Jacobian at a state.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.contact_kinematics import State
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


def smooth_step(x: float) -> float:
    """Return 0 below 0, 1 above 1, and the fifth-order polynomial with flat ends in between."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)


def smooth_steps(x: FloatArray) -> FloatArray:
    """Return `smooth_step` of every entry."""
    y = np.clip(x, 0.0, 1.0)
    return np.asarray(y**3 * (10.0 - 15.0 * y + 6.0 * y * y))
