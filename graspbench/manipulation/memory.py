"""Arrays that lie one after another in one block of memory, for Python and for compiled code.

Handing an array to compiled code costs more than a finger's kinematics. What a control step needs is
therefore a few blocks, in which compiled code finds the arrays as Python does.
"""

from collections.abc import Callable
from typing import TypeVar

from numba.extending import register_jitable

from graspbench.arrays import FloatArray, IntArray

Function = TypeVar("Function", bound=Callable[..., object])
Array = TypeVar("Array", FloatArray, IntArray)


def shared(function: Function) -> Function:
    """Let a Python function be called from compiled code too."""
    registered: Function = register_jitable(function)
    return registered


@shared
def vector(memory: Array, at: int, a: int) -> tuple[Array, int]:
    """Return the ``a`` entries from ``at`` on, and where the next array begins."""
    return memory[at : at + a], at + a


@shared
def matrix(memory: Array, at: int, a: int, b: int) -> tuple[Array, int]:
    """Return the entries from ``at`` on as shape (a, b), and where the next array begins."""
    return memory[at : at + a * b].reshape((a, b)), at + a * b


@shared
def cube(memory: Array, at: int, a: int, b: int, c: int) -> tuple[Array, int]:
    """Return the entries from ``at`` on as shape (a, b, c), and where the next array begins."""
    return memory[at : at + a * b * c].reshape((a, b, c)), at + a * b * c
