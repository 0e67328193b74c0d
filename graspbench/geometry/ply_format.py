"""Mesh files in PLY, as text and as both kinds of binary: vertices, polygons and strips of triangles."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry.polygons import triangulated
from graspbench.geometry.refusals import MAX_TRIANGLES, MAX_VERTICES, announced, broken, too_many_triangles

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")
_MAX_HEADER_LINES = 1000
_MAX_LINE = 1_000_000


@dataclass(frozen=True)
class _Property:
    """One property: a number, or a list with the type of its length."""

    name: str
    kind: str
    length: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


def read_ply(file: Path) -> tuple[FloatArray, IntArray]:
    """Return vertices, shape (n, 3), and triangles, shape (m, 3), of a PLY file.

    Nothing is allocated that the file's own size does not bear out.

    Raises:
        MeshError: The file does not keep to the format, is cut off, or announces more than is read.
    """
    vertices, triangles = np.zeros((0, 3)), [np.zeros((0, 3), dtype=np.int64)]
    with file.open("rb") as stream:
        try:
            order, elements = _header(file, stream)
            body = _Text(stream) if order == "" else _Binary(stream.read(), order)
            for element in elements:
                columns = body.columns(element)
                if element.name == "vertex":
                    vertices = np.stack([columns[axis][0] for axis in "xyz"], axis=1).astype(np.float64)
                for name in _CORNERS:
                    if element.name in ("face", "tristrips") and name in columns:
                        corners, sizes = _whole(columns[name][0]), columns[name][1]
                        triangles.append(_triangles(file, element, vertices, corners, sizes))
                        break
        except (ValueError, KeyError, IndexError, OverflowError, TypeError):
            raise broken(file, "ply") from None
    return vertices, np.concatenate(triangles)


def _whole(values: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> IntArray:
    """Return numbers as whole ones; a ValueError when one is no vertex's number for sure."""
    numbers = values.astype(np.float64)
    if not np.all(np.abs(numbers) <= MAX_VERTICES):  # which is false for what is not a number, too
        raise ValueError("no number of a vertex")
    return numbers.astype(np.int64)


def _triangles(
    file: Path, element: _Element, vertices: FloatArray, corners: IntArray, sizes: IntArray
) -> IntArray:
    strips = element.name == "tristrips"
    if len(corners) and (corners.min() < -int(strips) or corners.max() >= len(vertices)):
        raise broken(file, "ply", "a face has a corner that does not exist")
    if strips:
        return _unstripped(corners, sizes)
    if int(np.maximum(sizes - 2, 0).sum()) > MAX_TRIANGLES:
        raise too_many_triangles(file, int(np.maximum(sizes - 2, 0).sum()))
    return triangulated(vertices, corners, sizes)


def _unstripped(corners: IntArray, sizes: IntArray) -> IntArray:
    """Return the triangles of strips: each corner makes one with the two before; -1 ends a strip as well."""
    ends = np.zeros(len(corners) + 1, dtype=bool)
    ends[np.cumsum(sizes)] = True
    stops = np.flatnonzero(corners < 0)
    ends[stops] = True
    ends[stops + 1] = True
    strip = np.cumsum(ends[:-1])
    first = np.searchsorted(strip, strip)  # where each corner's strip begins
    last = np.arange(2, len(corners))
    within = (strip[2:] == strip[:-2]) & (corners[2:] >= 0) & (corners[:-2] >= 0)
    last = last[within]
    odd = (last - first[last]) % 2 == 1
    found = np.stack([corners[last - 2], corners[last - 1], corners[last]], axis=1)
    found[odd] = found[odd][:, [1, 0, 2]]
    return found


def _header(file: Path, stream: BinaryIO) -> tuple[str, list[_Element]]:
    lines = []
    for line in islice(iter(lambda: stream.readline(_MAX_LINE), b""), _MAX_HEADER_LINES):
        words = line.decode("ascii", errors="replace").split()
        if words == ["end_header"]:
            break
        lines.append(words)
    else:
        raise ValueError("no end of the header")
    if not lines or lines[0] != ["ply"]:
        raise broken(file, "ply", "it does not begin with ply")
    order = _ORDERS[next((words[1] for words in lines if words[:1] == ["format"]), "none")]
    elements: list[_Element] = []
    for words in lines:
        match words:
            case ["element", name, count]:
                if not (count.isascii() and count.isdigit()):
                    raise ValueError("no number")
                if int(count[:19]) > MAX_VERTICES:
                    raise announced(file, int(count[:19]))
                elements.append(_Element(name, int(count), ()))
            case ["property", "list", length, kind, name]:
                _extend(elements, _Property(name, _TYPES[kind], _TYPES[length]))
            case ["property", kind, name]:
                _extend(elements, _Property(name, _TYPES[kind]))
    return order, elements


def _extend(elements: list[_Element], new: _Property) -> None:
    last = elements[-1]
    elements[-1] = _Element(last.name, last.count, (*last.properties, new))


Columns = dict[str, tuple["np.ndarray[tuple[int, ...], np.dtype[np.generic]]", IntArray]]
"""By property: all values, one after the other, and how many each row has."""


class _Text:
    """The body of a file in ASCII."""

    def __init__(self, stream: BinaryIO) -> None:
        self._lines = iter(lambda: stream.readline(_MAX_LINE), b"")

    def columns(self, element: _Element) -> Columns:
        values: dict[str, list[float]] = {item.name: [] for item in element.properties}
        sizes: dict[str, list[int]] = {item.name: [] for item in element.properties}
        for _ in range(element.count if element.properties else 0):
            words = next((words for line in self._lines if (words := line.split())), None)
            if words is None:
                raise ValueError("cut off")
            at = 0
            for item in element.properties:
                size = 1
                if item.length is not None:
                    size, at = int(words[at]), at + 1
                if not 0 <= size <= len(words) - at:
                    raise ValueError("too few words")
                values[item.name] += map(float, words[at : at + size])
                sizes[item.name].append(size)
                at += size
        return {name: (np.array(values[name]), np.array(sizes[name], dtype=np.int64)) for name in values}


class _Binary:
    """The body of a binary file."""

    def __init__(self, content: bytes, order: str) -> None:
        self._content, self._order, self._at = content, order, 0

    def columns(self, element: _Element) -> Columns:
        if not element.properties or element.count == 0:
            none = np.zeros(0, dtype=np.int64)
            return {item.name: (none, none) for item in element.properties}
        return self._alike(element) or self._one_by_one(element)

    def _alike(self, element: _Element) -> Columns | None:
        """Read rows of one length at once, if all of them have the lists of the first one's length."""
        fields, lengths, at = [], {}, self._at
        for k, item in enumerate(element.properties):
            if item.length is None:
                fields.append((f"{k}", self._order + item.kind, (1,)))
                at += np.dtype(item.kind).itemsize
                continue
            size = lengths[f"{k} length"] = int(self._take(item.length, at, 1)[0])
            fields += [
                (f"{k} length", self._order + item.length, (1,)),
                (f"{k}", self._order + item.kind, (size,)),
            ]
            at += np.dtype(item.length).itemsize + size * np.dtype(item.kind).itemsize
        row = at - self._at
        if row * element.count > len(self._content) - self._at:
            return None
        table = np.frombuffer(self._content, np.dtype(fields), element.count, self._at)
        if any(np.any(table[name] != length) for name, length in lengths.items()):
            return None
        self._at += row * element.count
        columns: Columns = {}
        for k, item in enumerate(element.properties):
            values = table[f"{k}"]
            columns[item.name] = (values.ravel(), np.full(element.count, values.shape[1], dtype=np.int64))
        return columns

    def _one_by_one(self, element: _Element) -> Columns:
        if len(self._content) - self._at < element.count * len(element.properties):
            raise ValueError("cut off")  # each property of each row takes a byte at least
        values: dict[str, list[float]] = {item.name: [] for item in element.properties}
        sizes: dict[str, list[int]] = {item.name: [] for item in element.properties}
        for _ in range(element.count):
            for item in element.properties:
                size = 1
                if item.length is not None:
                    size = int(self._take(item.length, self._at, 1)[0])
                    self._at += np.dtype(item.length).itemsize
                values[item.name] += self._take(item.kind, self._at, size).tolist()
                self._at += size * np.dtype(item.kind).itemsize
                sizes[item.name].append(size)
        return {name: (np.array(values[name]), np.array(sizes[name], dtype=np.int64)) for name in values}

    def _take(self, kind: str, at: int, count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
        """Return numbers; a ValueError when the file is too short for them, or they are fewer than none."""
        if count < 0:
            raise ValueError("a negative length")
        return np.frombuffer(self._content, self._order + kind, count, at)
