"""A mesh that grows while its text file is read, block by block."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TextIO

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry.polygons import triangulated
from graspbench.geometry.refusals import broken, shortened, too_large

Row = tuple[int, list[str]]
"""The number of a line, and its words."""

Block = tuple[int, str]
"""The number of the first line of some, and their text."""

_BLOCK = 1 << 22
_MAX_LINE = 1_000_000


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
        self._check_vertices()

    def add_polygons(self, polygons: list[list[int]]) -> None:
        """Add polygons by their corners; whether these exist is found out at the end."""
        try:
            self._corners.extend(chain.from_iterable(polygons))
        except OverflowError:
            raise self.broken("a face has a corner that does not exist") from None
        self._sizes.extend(map(len, polygons))
        self._check_triangles()

    def add_tables(self, vertices: FloatArray, polygons: IntArray) -> None:
        """Add vertices, shape (n, 3), and polygons of one size, shape (m, k)."""
        self._coordinates.frombytes(np.ascontiguousarray(vertices, dtype=np.float64).tobytes())
        self._corners.frombytes(np.ascontiguousarray(polygons, dtype=np.int64).tobytes())
        self._sizes.frombytes(np.full(len(polygons), polygons.shape[1], dtype=np.int64).tobytes())
        self._check_vertices()
        self._check_triangles()

    def _check_vertices(self) -> None:
        if self.n_vertices > 3 * self._max:
            raise too_large(self.file, f"more than {3 * self._max} vertices")

    def _check_triangles(self) -> None:
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


def blocks_of(text: TextIO, mesh: TextMesh, *, joined: bool = False) -> Iterator[Block]:
    """Yield some thousand lines at a time.

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
            yield number, whole
            number += whole.count("\n") + 1
    if rest:
        yield number, rest


def rows_of(block: Block, *, joined: bool = False) -> list[Row]:
    """Return the lines of a block as words, without comments and empty lines."""
    number, text = block
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
