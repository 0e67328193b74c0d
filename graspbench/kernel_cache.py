"""A cache of compiled kernels that knows all that was compiled into them.

Numba keeps a kernel's machine code while the file of the kernel itself is unchanged. But the helpers that a
kernel calls are compiled into it, and the constants that it reads are frozen in it, from whatever file they
come: change one of those, and Numba goes on with the old code. Here the key of a kernel has a digest of
everything that it can reach.
"""

import hashlib
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numba.core.caching import FunctionCache
from numba.core.types import Type

_OWN = "graspbench"


class KernelCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """Numba's cache on disk, whose keys tell what a kernel was compiled with."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), fingerprint(self._py_func))


def fingerprint(function: Callable[..., Any]) -> str:
    """Return a digest of a function's code and of all that it can reach.

    These are the functions it calls, compiled or not, and theirs; constants, arrays and layouts of records
    that they read, from any file. Comments, docstrings and places in files do not count.
    """
    digest = hashlib.sha256()
    for line in _reached(function, set()):
        digest.update(line.encode())
        digest.update(b"\0")
    return digest.hexdigest()


def _reached(thing: Any, seen: set[int]) -> Iterator[str]:
    """Yield what there is to tell of a thing that a function reads, once each."""
    function = _function_of(thing)
    if function is not None:
        if id(function) not in seen:
            seen.add(id(function))
            yield from _code(function.__code__, function, seen)
            yield str(sorted(getattr(thing, "targetoptions", {}).items()))
            for annotation in function.__annotations__.values():  # the fields of tuples are read by place
                yield from _reached(annotation, seen)
            for cell in function.__closure__ or ():
                yield from _reached(cell.cell_contents, seen)
    elif isinstance(thing, np.ndarray):
        yield f"{thing.dtype} {thing.shape} {hashlib.sha256(thing.tobytes()).hexdigest()}"
    elif isinstance(thing, tuple | list):
        for each in thing:
            yield from _reached(each, seen)
    elif isinstance(thing, type):
        yield f"{thing.__qualname__} {getattr(thing, 'declared', getattr(thing, '_fields', ''))}"
    elif isinstance(thing, int | float | complex | str | bytes | None | Type):
        yield repr(thing)
    else:
        yield type(thing).__qualname__


def _function_of(thing: Any) -> types.FunctionType | None:
    """Return the Python function behind a kernel or an intrinsic, or itself; None for a library's."""
    function = getattr(thing, "py_func", None) or getattr(thing, "_defn", None) or thing
    if not isinstance(function, types.FunctionType) or function.__module__.partition(".")[0] in _LIBRARIES:
        return None
    return function


# Their versions are pinned, and Numba's own is in its key.
_LIBRARIES = frozenset({"numba", "numpy", "math", "llvmlite"})


def _code(code: types.CodeType, function: types.FunctionType, seen: set[int]) -> Iterator[str]:
    yield hashlib.sha256(code.co_code).hexdigest()
    yield str(code.co_varnames)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code(constant, function, seen)
        elif constant != function.__doc__:
            yield repr(constant)
    modules = []
    for name in code.co_names:
        yield name
        if name in function.__globals__:
            found = function.__globals__[name]
            modules += [found] if isinstance(found, types.ModuleType) else []
            yield from _reached(found, seen)
    for module in modules:
        if module.__name__.partition(".")[0] == _OWN:
            for name in code.co_names:
                yield from _reached(getattr(module, name, None), seen)
