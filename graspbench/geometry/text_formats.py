"""Mesh files of plain text, read block by block: Wavefront OBJ, OFF and STL in ASCII.

Coordinates go into flat arrays of machine numbers, so that a file takes little more memory than its mesh,
and every complaint names a line or a face.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import TextIO

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry.polygons import triangulated
from graspbench.geometry.refusals import MAX_VERTICES, announced, broken, shortened, too_large

Row = tuple[int, list[str]]
"""The number of a line, and its words."""

_BLOCK = 1 << 22
_MAX_LINE = 1_000_000

_OFF_HEADER = re.compile(r"(ST)?C?N?(4|n|4n)?OFF(\d*)")


def read_text_mesh(file: Path, suffix: str, max_triangles: int) -> tuple[FloatArray, IntArray]:
    """Return vertices, shape (n, 3), and triangles, shape (m, 3); polygons are triangulated.

    Args:
        file: The file, in UTF-8, or in UTF-16 with its byte order mark.
        suffix: Its format: "obj", "off" or "stl".
        max_triangles: Reading stops with an error after so many triangles, or three times as many vertices.

    Raises:
        MeshError: A line cannot be read, a corner does not exist, the file is cut off, or is too large.
    """
    with file.open("rb") as stream:
        mark = stream.read(2)
    encoding = "utf-16" if mark in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    mesh = TextMesh(file, suffix, max_triangles)
    with file.open(encoding=encoding, errors="replace") as text:
        _READERS[suffix](mesh, _blocks(text, mesh, joined=suffix == "obj"))
    return mesh.arrays()


def _blocks(text: TextIO, mesh: TextMesh, *, joined: bool) -> Iterator[list[Row]]:
    """Yield some thousand lines at a time, without comments and empty lines.

    Args:
        text: The open file.
        mesh: Whose file it is.
        joined: Whether a line that ends in a backslash goes on in the next one.
    """
    number, rest = 1, ""
    while piece := text.read(_BLOCK):
        whole, end, rest = (rest + piece).rpartition("\n")
        if joined and whole.endswith("\\"):
            whole, end, rest = "", "", whole + end + rest
        if len(rest) > _MAX_LINE + _BLOCK or (not end and len(rest) > _MAX_LINE):
            raise mesh.broken(f"a line from line {number} on has more than {_MAX_LINE} characters")
        if end:
            yield _rows(whole, number, joined)
            number += whole.count("\n") + 1
    if rest:
        yield _rows(rest, number, joined)


def _rows(text: str, number: int, joined: bool) -> list[Row]:
    lines = text.split("\n")
    if "#" in text:
        lines = [line.partition("#")[0] for line in lines]
    if joined and "\\" in text:
        lines = _joined(lines)
    return [(k, words) for k, line in enumerate(lines, number) if (words := line.split())]


def _joined(lines: list[str]) -> list[str]:
    """Return the lines with what is continued put together in its last line; their number stays."""
    result, carried = [], ""
    for line in lines:
        text = carried + line
        if line.rstrip().endswith("\\"):
            carried = text.rstrip()[:-1] + " "
            result.append("")
        else:
            carried = ""
            result.append(text)
    return [*result, carried] if carried else result


class TextMesh:
    """A mesh that grows while its file is read.

    Args:
        file: The file, for errors.
        suffix: Its format, for errors.
        max_triangles: How many triangles it may have at most.
    """

    def __init__(self, file: Path, suffix: str, max_triangles: int) -> None:
        self.file, self._suffix, self._max = file, suffix, max_triangles
        self._coordinates, self._corners, self._sizes = array("d"), array("q"), array("q")

    @property
    def n_vertices(self) -> int:
        """How many vertices have been read."""
        return len(self._coordinates) // 3

    def add_vertices(self, rows: list[Row], first: int = 0) -> None:
        """Add a vertex a row, whose coordinates are three words from the first on."""
        try:
            values = [float(word) for _, words in rows for word in words[first : first + 3]]
        except ValueError:
            values = []
        if len(values) != 3 * len(rows):
            line, words = next(row for row in rows if not _is_point(row[1][first : first + 3]))
            raise self.broken(f"in line {line} '{shortened(words[first:])}' is no point")
        self._coordinates.extend(values)
        if self.n_vertices > 3 * self._max:
            raise too_large(self.file, f"more than {3 * self._max} vertices")

    def add_polygons(self, polygons: list[list[int]]) -> None:
        """Add polygons by their corners; whether these exist is found out at the end."""
        self._sizes.extend(map(len, polygons))
        self._corners.extend(chain.from_iterable(polygons))
        if len(self._corners) - 2 * len(self._sizes) > self._max:
            raise too_large(self.file, f"more than the {self._max} triangles that are read")

    def arrays(self) -> tuple[FloatArray, IntArray]:
        """Return vertices, shape (n, 3), and triangles, shape (m, 3)."""
        vertices = np.array(self._coordinates, dtype=np.float64).reshape(-1, 3)
        corners = np.array(self._corners, dtype=np.int64)
        if len(wrong := np.flatnonzero((corners < 0) | (corners >= len(vertices)))):
            face = int(np.searchsorted(np.cumsum(self._sizes), wrong[0], side="right"))
            raise self.broken(f"face {face + 1} has a corner that does not exist")
        return vertices, triangulated(vertices, corners, np.array(self._sizes, dtype=np.int64))

    def broken(self, why: str) -> MeshError:
        """Return the error of a file that cannot be read."""
        return broken(self.file, self._suffix, why)


def _is_point(words: list[str]) -> bool:
    try:
        return len([float(word) for word in words]) == 3
    except ValueError:
        return False


def _read_obj(mesh: TextMesh, blocks: Iterator[list[Row]]) -> None:
    """Read the v and f lines; a corner is v, v/vt, v//vn or v/vt/vn, from 1, or from -1 backwards."""
    for rows in blocks:
        before = mesh.n_vertices
        mesh.add_vertices([row for row in rows if row[1][0] == "v"], 1)
        faces = [row for row in rows if row[1][0] == "f"]
        try:
            # Zero is no number of a vertex: minus one is refused.
            polygons = [[int(word.partition("/")[0]) - 1 for word in words[1:]] for _, words in faces]
        except (ValueError, OverflowError):
            line, words = next(row for row in faces if not _is_face(row[1][1:]))
            raise mesh.broken(f"in line {line} '{shortened(words)}' is no face") from None
        if any(corner < -1 for polygon in polygons for corner in polygon):
            polygons = _counted_backwards(rows, polygons, before)
        _add(mesh, polygons)


def _add(mesh: TextMesh, polygons: list[list[int]]) -> None:
    try:
        mesh.add_polygons(polygons)
    except OverflowError:
        raise mesh.broken("a face has a corner that does not exist") from None


def _is_face(words: list[str]) -> bool:
    try:
        return bool([int(word.partition("/")[0]) for word in words]) or not words
    except ValueError:
        return False


def _counted_backwards(rows: list[Row], polygons: list[list[int]], n_vertices: int) -> list[list[int]]:
    """Resolve corners that count backwards from the vertex before the face: -1, here -2, is the last one."""
    resolved, following = [], iter(polygons)
    for _, words in rows:
        if words[0] == "v":
            n_vertices += 1
        elif words[0] == "f":
            polygon = next(following)
            resolved.append([n_vertices + corner + 1 if corner < -1 else corner for corner in polygon])
    return resolved


def _read_off(mesh: TextMesh, blocks: Iterator[list[Row]]) -> None:
    """Read the counts, the vertices, and the polygons with their numbers of corners."""
    rows = chain.from_iterable(blocks)
    line, words = next(rows, (1, [""]))
    header = _OFF_HEADER.fullmatch(words[0])
    if header is None or header[2] or words[1:2] == ["BINARY"]:
        what = (
            "it does not begin with OFF"
            if header is None
            else "only OFF of points in space, as text, is read"
        )
        raise mesh.broken(what)
    counts = [*([header[3]] if header[3] else []), *words[1:]] or next(rows, (line, []))[1]
    if len(counts) < 2 or not all(word.isascii() and word.isdigit() for word in counts[:2]):
        raise mesh.broken("the numbers of its vertices and faces are missing")
    n_vertices, n_faces = int(counts[0][:19]), int(counts[1][:19])
    if max(n_vertices, n_faces) > MAX_VERTICES:
        raise announced(mesh.file, max(n_vertices, n_faces))
    missing = mesh.broken(f"it is cut off before its {n_vertices} vertices and {n_faces} faces end")
    for some in _portions(rows, n_vertices, missing):
        mesh.add_vertices(some)
    for some in _portions(rows, n_faces, missing):
        _add(mesh, [_counted_corners(mesh, *row) for row in some])


def _counted_corners(mesh: TextMesh, line: int, words: list[str]) -> list[int]:
    """Return the corners of a polygon that begins with their number."""
    try:
        corners = [int(word) for word in words[1 : 1 + int(words[0])]]
    except ValueError:
        corners = []
    if str(len(corners)) != words[0].lstrip("+0") and words[0].strip("+-0"):
        raise mesh.broken(f"in line {line} '{shortened(words)}' is no face")
    return corners


def _portions(rows: Iterator[Row], count: int, missing: MeshError, size: int = 50_000) -> Iterator[list[Row]]:
    """Yield so many rows in portions."""
    while count > 0:
        some = list(islice(rows, min(count, size)))
        if len(some) < min(count, size):
            raise missing
        count -= len(some)
        yield some


def _read_ascii_stl(mesh: TextMesh, blocks: Iterator[list[Row]]) -> None:
    """Read the vertices between each facet's outer loop and endloop."""
    inside, first, n_vertices = False, 0, 0
    for rows in blocks:
        points, polygons = [], []
        for row in rows:
            match row[1][0].lower():
                case "vertex" if inside:
                    points.append(row)
                    n_vertices += 1
                case "outer":
                    first = n_vertices
                case "endloop":
                    polygons.append(list(range(first, n_vertices)))
                case "solid":
                    inside = True
                case "endsolid":
                    inside = False
        mesh.add_vertices(points, 1)
        mesh.add_polygons(polygons)
    if inside:
        raise mesh.broken("it is cut off before endsolid")


_READERS: dict[str, Callable[[TextMesh, Iterator[list[Row]]], None]] = {
    "obj": _read_obj,
    "off": _read_off,
    "stl": _read_ascii_stl,
}
