"""NumPy files that hold objects, read without executing anything that stands in them.

NumPy stores dicts and lists in ``.npy`` files as pickles, and a pickle is a program. This reader knows
NumPy's own constructors of arrays, types and scalars only, and refuses a file that names anything else.
"""

import io
import math
import pickle
import pickletools
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.evaluation.formats.error import GraspFileError

MAX_FILE_BYTES = 1 << 30
_MAX_DIMENSIONS = 8
_PLAIN_TYPE = re.compile(r"[<>|=]?(?:[biufc][0-9]{1,2}|[SU][0-9]{1,6}|O8?)")
_MEMO_OPCODE = "LONG_BINPUT"


class _Type:
    """Stands for NumPy's types of numbers and texts: what a pickle says of one is checked, not obeyed.

    NumPy's own types take any state, also one in which plain bytes are pointers to objects.
    """

    def __init__(self, code: Any, *_: Any) -> None:
        if not isinstance(code, str) or _PLAIN_TYPE.fullmatch(code) is None:
            raise pickle.UnpicklingError("an array of an odd type")
        self.dtype = np.dtype(code)

    def __setstate__(self, state: Any) -> None:
        order, nested, size = _type_state(state)
        if nested or size not in (-1, self.dtype.itemsize):
            raise pickle.UnpicklingError("an array of an odd type")
        self.dtype = self.dtype.newbyteorder(order)


class _Array(np.ndarray[Any, Any]):
    """An array whose content is checked against its shape and type before it is taken over."""

    def __new__(cls, *_: Any) -> "_Array":
        raise pickle.UnpicklingError("an array that is made by a call")

    def __setstate__(self, state: Any) -> None:
        _, shape, kind, fortran, content = state
        dtype, count = _plain(kind), _size(shape)
        whole = list if dtype.hasobject else bytes
        length = count if dtype.hasobject else count * dtype.itemsize
        if not isinstance(content, whole) or len(content) != length:
            raise pickle.UnpicklingError("an array of another size than it says")
        checked: Any = (1, shape, dtype, bool(fortran), content)
        super().__setstate__(checked)


def _type_state(state: Any) -> tuple[Any, bool, int]:
    """Return byte order, whether it has parts, and the size of an item that the state of a type states."""
    if not isinstance(state, tuple) or len(state) < 8 or state[1] not in ("<", ">", "|", "="):
        raise pickle.UnpicklingError("an array of an odd type")
    return state[1], any(part is not None for part in (*state[2:5], *state[8:])), state[5]


def _plain(kind: Any) -> np.dtype[Any]:
    if not isinstance(kind, _Type):
        raise pickle.UnpicklingError("an array of an odd type")
    return kind.dtype


def _size(shape: Any) -> int:
    known = isinstance(shape, tuple) and all(type(length) is int and length >= 0 for length in shape)
    if not known or len(shape) > _MAX_DIMENSIONS:
        raise pickle.UnpicklingError("an array of an odd shape")
    return math.prod(shape)


def _encoded(text: Any, encoding: Any) -> bytes:
    """Return the bytes that old pickles store as text."""
    if encoding != "latin1":
        raise pickle.UnpicklingError("text in an odd encoding")
    return str(text).encode("latin1")


def _reconstruct(kind: Any, shape: Any, code: Any) -> np.ndarray[Any, Any]:
    """Return an empty array that waits for its content, as NumPy's own function of that name does."""
    if kind is not _Array or shape != (0,) or code not in (b"b", "b"):
        raise pickle.UnpicklingError("an array of an odd kind")
    return np.ndarray.__new__(_Array, (0,), "b")


def _scalar(kind: Any, content: Any = None) -> Any:
    dtype = _plain(kind)
    if dtype.hasobject or not isinstance(content, bytes) or len(content) != dtype.itemsize:
        raise pickle.UnpicklingError("a scalar of an odd type")
    return np.frombuffer(content, dtype=dtype, count=1)[0]


def _frombuffer(content: Any, kind: Any, shape: Any, order: Any) -> np.ndarray[Any, Any]:
    dtype, count = _plain(kind), _size(shape)
    if dtype.hasobject or not isinstance(content, bytes | bytearray | memoryview):
        raise pickle.UnpicklingError("an array of an odd type")
    found = np.frombuffer(bytes(content), dtype=dtype)
    if found.size != count:
        raise pickle.UnpicklingError("an array of another size than it says")
    return found.reshape(shape, order="F" if order == "F" else "C")


class _Maker:
    """A constructor that a pickle may call, and that it can do nothing else with."""

    __slots__ = ("_make",)

    def __init__(self, make: Callable[..., Any]) -> None:
        self._make = make

    def __call__(self, *arguments: Any) -> Any:
        return self._make(*arguments)

    def __setstate__(self, state: Any) -> None:
        raise pickle.UnpicklingError("a state for what has none")


_CONSTRUCTORS: Mapping[tuple[str, str], Any] = {
    (f"numpy{core}", name): made
    for core in (".core.multiarray", "._core.multiarray")
    for name, made in (("_reconstruct", _Maker(_reconstruct)), ("scalar", _Maker(_scalar)))
} | {
    ("numpy.core.numeric", "_frombuffer"): _Maker(_frombuffer),
    ("numpy._core.numeric", "_frombuffer"): _Maker(_frombuffer),
    ("numpy", "ndarray"): _Array,
    ("numpy", "dtype"): _Type,
    ("collections", "OrderedDict"): dict,
    ("_codecs", "encode"): _Maker(_encoded),
}


class _PlainUnpickler(pickle.Unpickler):
    """Makes arrays, numbers, texts and containers of these; calls nothing else."""

    def find_class(self, module: str, name: str) -> Any:
        try:
            return _CONSTRUCTORS[module, name]
        except KeyError:
            raise _CodeError(f"{module}.{name}") from None

    def persistent_load(self, pid: Any) -> Any:
        raise pickle.UnpicklingError("a reference to something outside the file")


def _check_memo(content: bytes) -> None:
    """Refuse a pickle that numbers what it remembers beyond its own length: room is made for all of them."""
    for opcode, argument, _ in pickletools.genops(content):
        if opcode.name == _MEMO_OPCODE and int(argument or 0) > len(content):
            raise pickle.UnpicklingError("it remembers more than it can hold")


class _CodeError(pickle.UnpicklingError):
    """The pickle asks for something that is no plain data."""


def grasps_of(content: Any) -> Any:
    """Return the objects of an array of objects as a list, and anything else as it is."""
    return content.tolist() if isinstance(content, np.ndarray) and content.dtype.hasobject else content


def load_npy(path: Path) -> Any:
    """Return what a ``.npy`` file holds: an array, or the object or array of objects stored in it.

    Raises:
        GraspFileError: It is no such file, damaged, too large, or would execute code.
    """
    try:
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise GraspFileError(f"{path} is too large ({size >> 20} MB)", remedy="split it", path=str(path))
        with path.open("rb") as stream:
            return _loaded(stream, size, path)
    except OSError as error:
        raise GraspFileError(
            f"{path} cannot be read ({error.strerror or error})", remedy="check the file", path=str(path)
        ) from error


def _loaded(stream: Any, size: int, path: Path) -> Any:
    try:
        version = np.lib.format.read_magic(stream)
        read = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, fortran, kind = read(stream)
        if not kind.hasobject:
            stream.seek(0)
            return np.lib.format.read_array(stream, allow_pickle=False)
        if kind != np.dtype(object):
            raise ValueError("objects inside of records")
        content = stream.read(size)
        _check_memo(content)
        found = _PlainUnpickler(io.BytesIO(content)).load()
    except _CodeError as error:
        raise GraspFileError(
            f"{path} holds code ('{error}'), not only data, and nothing of it was executed",
            remedy="save plain arrays, numbers, lists and dicts, and trust no one who sent it",
            path=str(path),
        ) from None
    except GraspFileError:
        raise
    except Exception as error:  # a damaged pickle may raise anything
        raise GraspFileError(
            f"{path} is no readable NumPy file ({str(error)[:80] or type(error).__name__})",
            remedy="save it anew with numpy.save",
            path=str(path),
        ) from None
    del fortran
    if not isinstance(found, np.ndarray) or found.shape != tuple(shape):
        raise GraspFileError(
            f"{path} does not hold what its header says", remedy="save it anew", path=str(path)
        )
    return found.item() if found.ndim == 0 else found
