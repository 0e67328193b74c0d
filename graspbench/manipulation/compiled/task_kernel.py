"""Kernels of secondary tasks: written in the task's own file, compiled on their own, called by address.

So the control step is compiled once, whatever tasks there are, and a task's kernel when it is first used.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar, cast, get_type_hints

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from graspbench.compiled import compiled_callback
from graspbench.manipulation.compiled.record_type import RecordType, opener_at
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays

T = TypeVar("T", bound=TaskArrays)


class TaskKernel:
    """The compiled function that writes a task's rows at a state.

    Args:
        function: ``(system, state, task) -> rows``: it writes value, error (desired minus actual),
            activation and Jacobian of its rows into ``task`` and returns how many there are. The class of
            ``task``, a `TaskArrays`, is read off its annotation.

    Attributes:
        arrays: That class.
    """

    def __init__(self, function: Callable[[SystemArrays, StateArrays, T], int]) -> None:
        self._function = function
        *_, last = (hint for name, hint in get_type_hints(function).items() if name != "return")
        self.arrays: type[TaskArrays] = last

    @cached_property
    def address(self) -> int:
        """Where the machine code is; compiled on first use, and cached on disk."""
        signature = types.int64(RecordType(SystemArrays), RecordType(StateArrays), RecordType(self.arrays))
        self._compiled = compiled_callback(signature, self._function)
        return int(self._compiled.address)


def task_kernel(function: Callable[[SystemArrays, StateArrays, T], int]) -> TaskKernel:
    """Make a function the kernel of a task; see `TaskKernel`."""
    return TaskKernel(function)


task_at = opener_at(TaskArrays)


@intrinsic
def _call(_typing: Any, address: Any, system: Any, state: Any, task: Any) -> Any:
    def lower(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        entry = ir.FunctionType(ir.IntType(64), [cgutils.voidptr_t] * 3)
        return builder.call(builder.inttoptr(args[0], entry.as_pointer()), args[1:])

    return types.int64(address, system, state, task), lower


call_kernel = cast("Callable[[int, SystemArrays, StateArrays, TaskArrays], int]", _call)
"""Call the kernel at an address, in compiled code."""
