"""Functions that Python and compiled code both call."""

from collections.abc import Callable
from typing import TypeVar

from numba.extending import register_jitable

Function = TypeVar("Function", bound=Callable[..., object])


def shared(function: Function) -> Function:
    """Let a Python function be called from compiled code too."""
    registered: Function = register_jitable(function)
    return registered
