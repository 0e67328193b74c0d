"""Compiled data: each field is declared once, and its storage and views follow from the declaration.

A record is a class whose annotated fields have a shape in named sizes::

    class Example(Record):
        gain: float
        parents: Annotated[IntArray, "joints"]
        jacobians: Annotated[FloatArray, "contacts", 6, "joints"]

``Example(parents=..., sizes={"contacts": 3}, gain=1.0)`` lays it out in one block of memory, in which Python
sees the fields as arrays, and compiled code as the same attributes (see `record_type`). Handing an array to
compiled code costs more than a finger's kinematics; a record costs as much as one array, whatever it holds.

A block is made of words of 8 bytes. It begins with a header, field by field: a number itself, or where an
array begins and those of its lengths that have names. So a class's fields lie where those of its base do, and
compiled code that knows the base alone can read a block of the class.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from graspbench.arrays import FloatArray, IntArray


class Field(NamedTuple):
    """A field as declared.

    Attributes:
        name: Its name.
        integer: Whether it holds integers rather than floating-point numbers.
        shape: Names of sizes, or lengths that never change; None for a single number.
        header: Word of the header where it begins.
    """

    name: str
    integer: bool
    shape: tuple[str | int, ...] | None
    header: int

    @property
    def words(self) -> int:
        """Words it takes in the header."""
        return 1 if self.shape is None else 1 + sum(isinstance(length, str) for length in self.shape)


class Record:
    """A block of memory with named fields; see the module.

    Args:
        sizes: Named sizes that no given array tells.
        **given: Values by field: all numbers, and those arrays that do not begin as zeros.

    Raises:
        TypeError: A field is unknown, or a number is missing.
        ValueError: Two arrays disagree on a size, or a size is not known.

    Attributes:
        declared: Of a class: its fields in the order of their declaration, those of its base first.
        block: The memory, shape (n,).
    """

    declared: ClassVar[tuple[Field, ...]] = ()
    block: FloatArray

    def __init_subclass__(cls) -> None:
        found, header = list[Field](), 0
        for name, hint in get_type_hints(cls, include_extras=True).items():
            if hint in (int, float):
                field = Field(name, hint is int, None, header)
            elif get_origin(hint) is Annotated:
                array, *shape = get_args(hint)
                field = Field(name, array == IntArray, tuple(shape), header)
            else:
                continue
            found.append(field)
            header += field.words
        cls.declared = tuple(found)

    def __init__(self, *, sizes: Mapping[str, int] | None = None, **given: Any) -> None:
        declared = self.declared
        unknown = set(given) - {field.name for field in declared}
        if unknown:
            raise TypeError(f"{type(self).__name__} has no field {', '.join(sorted(unknown))}")
        known = _sizes(type(self), dict(sizes or {}), given)
        shapes = [
            None if f.shape is None else tuple(known[s] if isinstance(s, str) else s for s in f.shape)
            for f in declared
        ]
        at = declared[-1].header + declared[-1].words
        starts = []
        for shape in shapes:
            starts.append(at)
            at += 0 if shape is None else int(np.prod(shape))
        self.block = np.zeros(at)
        header = self.block.view(np.int64)
        for field, shape, start in zip(declared, shapes, starts, strict=True):
            if shape is None or field.shape is None:
                value = int(given[field.name]) if field.integer else float(given[field.name])
                (header if field.integer else self.block)[field.header] = value
                setattr(self, field.name, value)
                continue
            named = [length for length, name in zip(shape, field.shape, strict=True) if isinstance(name, str)]
            header[field.header : field.header + field.words] = [start, *named]
            words = header if field.integer else self.block
            view = words[start : start + int(np.prod(shape))].reshape(shape)
            view[...] = given.get(field.name, 0)
            setattr(self, field.name, view)

    @property
    def address(self) -> int:
        """Where the block lies in memory; for compiled code that outlives no record."""
        return int(self.block.ctypes.data)


def _sizes(record: type[Record], sizes: dict[str, int], given: Mapping[str, Any]) -> dict[str, int]:
    """Return all sizes: those told, and those that follow from the given arrays."""
    for field in record.declared:
        if field.shape is None:
            if field.name not in given:
                raise TypeError(f"{record.__name__} needs a value for {field.name}")
        elif field.name in given:
            actual = np.shape(given[field.name])
            if len(actual) == len(field.shape):
                for name, length in zip(field.shape, actual, strict=True):
                    if isinstance(name, str):
                        sizes.setdefault(name, length)
            expected = tuple(sizes.get(n, -1) if isinstance(n, str) else n for n in field.shape)
            if actual != expected:
                names = ", ".join(map(str, field.shape))
                raise ValueError(
                    f"{record.__name__}.{field.name} has shape {actual}, not ({names}) = {expected}"
                )
    missing = {s for f in record.declared for s in f.shape or () if isinstance(s, str)} - set(sizes)
    if missing:
        raise ValueError(f"{record.__name__} needs the sizes {', '.join(sorted(missing))}")
    return sizes
