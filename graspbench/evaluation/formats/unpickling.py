"""NumPy files that hold objects, read without executing anything that stands in them.

NumPy stores dicts and lists in ``.npy`` files as pickles, and a pickle is a program. This reader knows
NumPy's own constructors of arrays, types and scalars only, and refuses a file that names anything else.
"""

import io
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.evaluation.formats.error import GraspFileError

MAX_FILE_BYTES = 1 << 30


class _Array:
    """Stands for the class of arrays, which a pickle names but must not call."""

    def __new__(cls, *_: Any) -> "_Array":
        raise pickle.UnpicklingError("an array that is made by a call")


def _encoded(text: Any, encoding: Any) -> bytes:
    """Return the bytes that old pickles store as text."""
    if encoding != "latin1":
        raise pickle.UnpicklingError("text in an odd encoding")
    return str(text).encode("latin1")


def _reconstruct(kind: type, shape: Any, code: Any) -> np.ndarray[Any, Any]:
    """Return an empty array, as NumPy's own function of that name does; of no subclass."""
    if kind is not _Array or shape != (0,):
        raise pickle.UnpicklingError("an array of an odd kind")
    return np.ndarray.__new__(np.ndarray, (0,), "b" if code == b"b" else str(code))


def _scalar(kind: Any, content: Any = None) -> Any:
    if not isinstance(kind, np.dtype) or kind.hasobject or not isinstance(content, bytes):
        raise pickle.UnpicklingError("a scalar of an odd type")
    return np.frombuffer(content, dtype=kind, count=1)[0]


def _frombuffer(content: Any, kind: Any, shape: Any, order: Any) -> np.ndarray[Any, Any]:
    if not isinstance(kind, np.dtype) or kind.hasobject:
        raise pickle.UnpicklingError("an array of an odd type")
    return np.frombuffer(bytes(content), dtype=kind).reshape(shape, order="F" if order == "F" else "C")


_CONSTRUCTORS: Mapping[tuple[str, str], Any] = {
    (f"numpy{core}", name): made
    for core in (".core.multiarray", "._core.multiarray")
    for name, made in (("_reconstruct", _reconstruct), ("scalar", _scalar))
} | {
    ("numpy.core.numeric", "_frombuffer"): _frombuffer,
    ("numpy._core.numeric", "_frombuffer"): _frombuffer,
    ("numpy", "ndarray"): _Array,
    ("numpy", "dtype"): np.dtype,
    ("collections", "OrderedDict"): dict,
    ("_codecs", "encode"): _encoded,
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
        found = _PlainUnpickler(io.BytesIO(stream.read(size))).load()
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
