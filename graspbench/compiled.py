"""How numerical kernels are compiled.

Both kinds go without checks for division by zero: the kernels guard their divisions, and the check would keep
loops from being vectorised. Neither has an entry for C. What only other kernels call, ``inner``, has none for
Python either: each entry costs as much compilation time as a small kernel.
"""

from collections.abc import Callable
from typing import TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a function for Python and for other kernels: cached on disk, without the interpreter lock."""
    fast: Function = njit(cache=True, nogil=True, error_model="numpy", no_cfunc_wrapper=True)(function)
    return fast


def inner(function: Function) -> Function:
    """Compile a function for other kernels only."""
    fast: Function = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)
    return fast
