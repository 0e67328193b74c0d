"""A cache of compiled kernels that knows all that was compiled into them.

Numba keeps a kernel's machine code while the file of the kernel itself is unchanged. But the helpers that a
kernel calls are compiled into it, and the constants that it reads are frozen in it, from whatever file they
come: change one of those, and Numba goes on with the old code. Here the key of a kernel has a digest of
everything that it can reach.

Nor does Numba expect two processes, as the workers of a sweep are, to compile one kernel at the same time, or
one to be killed as it writes: its index then names a file that has something else in it. Here one process
compiles and the others wait for what it made, and a file is named by what it is and written before the index.
"""

import fcntl
import hashlib
import os
import time
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.event import trigger_event
from numba.core.runtime import rtsys
from numba.core.types import Type

_OWN = "graspbench"
_LOOK_S = 0.05
_LONGEST_WAIT_S = 120.0


class KernelCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """Numba's cache on disk, whose keys tell what a kernel was compiled with."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        base = self._impl.filename_base
        self._cache_file = _KernelFiles(self._cache_path, base, self._impl.locator.get_source_stamp())
        self._turn = _Turn(os.path.join(self._cache_path, f"{base}.lock"))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return a compiled kernel, or None for who must compile it now, as nobody else does."""
        # Numba would first load all that it can compile with; what has been compiled needs the runtime alone.
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
        if found is None and self._turn.take():
            found = super().load_overload(sig, target_context)
            if found is not None:
                self._turn.give_up()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a kernel that has been compiled, for those who wait for it too."""
        try:
            super().save_overload(sig, data)
        finally:
            self._turn.give_up()

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), fingerprint(self._py_func))


class _KernelFiles(IndexDataCacheFile):  # type: ignore[misc]  # numba has no types
    """An index and its files: each is named by its key, and is there when the index names it."""

    def save(self, key: Any, data: Any) -> None:
        """Keep what was compiled under a key; drop what was compiled of code that has changed since."""
        base = self._index_name.removesuffix("nbi")
        name = f"{base}{hashlib.sha256(self._dump(key)).hexdigest()[:16]}.nbc"
        self._save_data(name, data)
        entries = self._load_index() | {key: name}
        self._save_index(entries)
        for other in os.listdir(self._cache_path):
            if other.startswith(base) and other.endswith(".nbc") and other not in entries.values():
                os.unlink(self._data_path(other))


class _Turn:
    """Whose turn it is to compile a kernel: a lock that ends with its process."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._lock: int | None = None

    def take(self) -> bool:
        """Wait for this process' turn; return whether another one had it meanwhile.

        Without a place for the lock, or when another process takes very long, nobody waits.
        """
        if self._lock is not None:
            return False
        try:
            os.makedirs(os.path.dirname(self._path), exist_ok=True)
            lock = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
        except OSError:
            return False
        self._lock = lock
        if _locked(lock):
            return True
        with trigger_event("numba:compile"):  # counts as compilation: it would have taken as long
            end = time.monotonic() + _LONGEST_WAIT_S
            while not _locked(lock) and time.monotonic() < end:
                time.sleep(_LOOK_S)
        return True

    def give_up(self) -> None:
        """Let others compile the kernel, or read it."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def _locked(lock: int) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


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
