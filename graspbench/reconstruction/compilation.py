"""How the loops of this package are compiled."""

from collections.abc import Callable
from typing import TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a function with numba: cached on disk, without the interpreter lock.

    Division by zero gives infinity as in numpy, because the check for it would keep the loops from
    being vectorised.
    """
    fast: Function = njit(cache=True, nogil=True, error_model="numpy")(function)
    return fast
