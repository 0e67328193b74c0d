"""How numerical kernels are compiled.

Both kinds go without checks for division by zero: the kernels guard their divisions, and the check would keep
loops from being vectorised. Neither has an entry for C. What only other kernels call, ``inner``, has none for
Python either: each entry costs as much compilation time as a small kernel.

Numba keeps a compiled function as long as its own file is unchanged, although what it calls, and the
constants it reads, are compiled into it from other files. So the key under which it is kept here holds all
of these.
"""

import hashlib
import time
from collections.abc import Callable, Iterator
from functools import cached_property
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher
from numba.core.event import Event, Listener, register
from numba.core.extending import _Intrinsic
from numba.core.typing import Signature

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a function for Python and for other kernels: cached on disk, without the interpreter lock."""
    fast: Any = njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True)(function)
    fast._cache = _KernelCache(function)
    kernel: Function = fast
    return kernel


def inner(function: Function) -> Function:
    """Compile a function for other kernels only."""
    fast: Function = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)
    return fast


def compiled_callback(signature: Signature, function: Callable[..., object]) -> Any:
    """Compile a function to be called by its ``address``: cached on disk."""
    callback: Any = CFunc(function, (signature.args, signature.return_type), {}, {"error_model": "numpy"})
    callback._cache = _KernelCache(function)
    callback.compile()
    return callback


class _KernelCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """Cache on disk that knows a function by all that is compiled into it."""

    @cached_property
    def _reached(self) -> str:
        digest = hashlib.sha256()
        for part in _parts(self._py_func, set()):
            digest.update(part)
        return digest.hexdigest()

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (*super()._index_key(sig, codegen), self._reached)


def _parts(function: Callable[..., object], seen: set[Callable[..., object]]) -> Iterator[bytes]:
    """Yield code and constants of a function and of all functions that it reaches, each once."""
    if not isinstance(function, FunctionType) or function in seen:
        return
    seen.add(function)
    for code in _codes(function.__code__):
        yield code.co_code
        yield repr([value for value in code.co_consts if not isinstance(value, CodeType)]).encode()
        yield repr((code.co_names, code.co_varnames)).encode()
        for name in code.co_names:
            value = function.__globals__.get(name)
            yield from _value_parts(value, seen)
            if isinstance(value, ModuleType):
                for attribute in code.co_names:
                    yield from _value_parts(getattr(value, attribute, None), seen)
    for cell in function.__closure__ or ():
        yield from _value_parts(cell.cell_contents, seen)


def _value_parts(value: object, seen: set[Callable[..., object]]) -> Iterator[bytes]:
    """Yield what a global or captured value adds to a function that reads it."""
    if isinstance(value, Dispatcher):
        yield repr(sorted(value.targetoptions.items())).encode()
        yield from _parts(value.py_func, seen)
    elif isinstance(value, _Intrinsic):
        yield from _parts(value._defn, seen)
    elif isinstance(value, FunctionType):
        yield from _parts(value, seen)
    elif isinstance(value, np.ndarray):
        yield repr((value.shape, value.dtype)).encode() + value.tobytes()
    elif isinstance(value, bool | int | float | complex | str | bytes | np.generic | tuple):
        yield repr(value).encode()


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield from _codes(value)


class _CompilationTimer(Listener):  # type: ignore[misc]  # numba has no types
    """Adds up the seconds in which numba compiles; what is read from its cache does not count."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth = 0
        self._started = 0.0

    def on_start(self, _event: Event) -> None:
        """A compilation begins, maybe inside another."""
        if self._depth == 0:
            self._started = time.perf_counter()
        self._depth += 1

    def on_end(self, _event: Event) -> None:
        """A compilation ends."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._started


_timer = _CompilationTimer()
register("numba:compile", _timer)


def seconds_compiling() -> float:
    """Return how long this process has been compiling inner loops until now."""
    return _timer.seconds
