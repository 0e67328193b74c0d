"""How numerical kernels are compiled.

Both kinds go without checks for division by zero: the kernels guard their divisions, and the check would keep
loops from being vectorised. Neither has an entry for C. What only other kernels call, ``inner``, has none for
Python either: each entry costs as much compilation time as a small kernel.
"""

import time
from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.core.ccallback import CFunc
from numba.core.event import Event, Listener, register
from numba.core.sigutils import normalize_signature

from graspbench.kernel_cache import KernelCache

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a function for Python and for other kernels: cached on disk, without the interpreter lock."""
    fast = njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True)(function)
    fast._cache = KernelCache(function)
    made: Function = fast
    return made


def callback(signature: Any, function: Callable[..., object]) -> Any:
    """Compile a function to be called at its ``address``: cached on disk."""
    made: Any = CFunc(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    made._cache = KernelCache(function)
    made.compile()
    return made


def inner(function: Function) -> Function:
    """Compile a function for other kernels only."""
    fast: Function = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)
    return fast


class _CompilationTimer(Listener):  # type: ignore[misc]  # numba has no types
    """Adds up the seconds in which numba compiles; what is read from its cache does not count."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.depth = 0
        self._started = 0.0

    def on_start(self, _event: Event) -> None:
        """A compilation begins, maybe inside another."""
        if self.depth == 0:
            self._started = time.perf_counter()
        self.depth += 1

    def on_end(self, _event: Event) -> None:
        """A compilation ends."""
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.perf_counter() - self._started


_timer = _CompilationTimer()
register("numba:compile", _timer)


def is_compiling() -> bool:
    """Tell whether this process is compiling an inner loop just now."""
    return _timer.depth > 0


def seconds_compiling() -> float:
    """Return how long this process has been compiling inner loops until now."""
    return _timer.seconds
