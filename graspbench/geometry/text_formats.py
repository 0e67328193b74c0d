"""Mesh files of plain text, read line by line: Wavefront OBJ, OFF and STL in ASCII.

Coordinates go into flat arrays of machine numbers, so that a file takes little more memory than its mesh,
and every complaint names a line.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError

_Line = tuple[int, list[str]]


def read_text_mesh(file: Path, suffix: str, max_triangles: int) -> tuple[FloatArray, IntArray]:
    """Return vertices, shape (n, 3), and triangles, shape (m, 3); polygons are cut into fans.

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
    mesh = _TextMesh(file, suffix, max_triangles)
    with file.open(encoding=encoding, errors="replace") as text:
        rows = ((k, line.partition("#")[0].split()) for k, line in enumerate(text, 1))
        _READERS[suffix](mesh, ((k, words) for k, words in rows if words))
    return mesh.arrays()


class _TextMesh:
    """A mesh that grows while its file is read."""

    def __init__(self, file: Path, suffix: str, max_triangles: int) -> None:
        self._file, self._suffix, self._most = file, suffix, max_triangles
        self._coordinates, self._corners = array("d"), array("q")

    @property
    def n_vertices(self) -> int:
        return len(self._coordinates) // 3

    def add_vertex(self, line: int, words: list[str]) -> None:
        try:
            x, y, z = map(float, words[:3])
        except ValueError:
            raise self.broken(f"in line {line} '{_short(words)}' is no point") from None
        self._coordinates.extend((x, y, z))
        if self.n_vertices > 3 * self._most:
            raise self._too_large(f"more than {3 * self._most} vertices")

    def add_polygon(self, line: int, corners: list[int]) -> None:
        if min(corners, default=0) < 0 or max(corners, default=0) >= self.n_vertices:
            raise self.broken(f"the face in line {line} has a corner that does not exist")
        for k in range(1, len(corners) - 1):
            self._corners.extend((corners[0], corners[k], corners[k + 1]))
        if len(self._corners) > 3 * self._most:
            raise self._too_large(f"more than the {self._most} triangles that are read")

    def arrays(self) -> tuple[FloatArray, IntArray]:
        return (
            np.array(self._coordinates, dtype=np.float64).reshape(-1, 3),
            np.array(self._corners, dtype=np.int64).reshape(-1, 3),
        )

    def broken(self, why: str) -> MeshError:
        return MeshError(
            f"{self._file.name} cannot be read as .{self._suffix} ({why})",
            remedy="copy or export it again",
            kind="broken",
            path=str(self._file),
        )

    def _too_large(self, what: str) -> MeshError:
        return MeshError(
            f"{self._file.name} has {what}",
            remedy="simplify the mesh before",
            kind="too_large",
            path=str(self._file),
        )


def _read_obj(mesh: _TextMesh, lines: Iterator[_Line]) -> None:
    """Read the v and f lines; a corner is v, v/vt, v//vn or v/vt/vn, from 1, or from -1 backwards."""
    for line, words in lines:
        if words[0] == "v":
            mesh.add_vertex(line, words[1:])
        elif words[0] == "f":
            try:
                numbers = [int(word.partition("/")[0]) for word in words[1:]]
            except ValueError:
                raise mesh.broken(f"in line {line} '{_short(words)}' is no face") from None
            # Zero is no number of a vertex: minus one refuses it.
            corners = [mesh.n_vertices + k if k < 0 else k - 1 for k in numbers]
            mesh.add_polygon(line, corners)


def _read_off(mesh: _TextMesh, lines: Iterator[_Line]) -> None:
    """Read the counts, the vertices, and the polygons with their numbers of corners."""
    line, words = next(lines, (1, []))
    if not words or words[0] not in ("OFF", "COFF"):
        raise mesh.broken("it does not begin with OFF")
    line, words = (line, words[1:]) if words[1:] else next(lines, (line, []))
    if len(words) < 2 or not (words[0].isdigit() and words[1].isdigit()):
        raise mesh.broken("the numbers of its vertices and faces are missing")
    n_vertices, n_faces = int(words[0]), int(words[1])
    for k in range(n_vertices + n_faces):
        if (row := next(lines, None)) is None:
            raise mesh.broken(f"it is cut off before its {n_vertices} vertices and {n_faces} faces end")
        line, words = row
        if k < n_vertices:
            mesh.add_vertex(line, words)
            continue
        try:
            corners = [int(word) for word in words[1 : 1 + int(words[0])]]
        except ValueError:
            raise mesh.broken(f"in line {line} '{_short(words)}' is no face") from None
        mesh.add_polygon(line, corners)


def _read_ascii_stl(mesh: _TextMesh, lines: Iterator[_Line]) -> None:
    """Read the vertices between each facet's outer loop and endloop."""
    inside, first = False, 0
    for line, words in lines:
        match words[0].lower():
            case "solid":
                inside = True
            case "endsolid":
                inside = False
            case "outer":
                first = mesh.n_vertices
            case "vertex" if inside:
                mesh.add_vertex(line, words[1:])
            case "endloop":
                mesh.add_polygon(line, list(range(first, mesh.n_vertices)))
    if inside:
        raise mesh.broken("it is cut off before endsolid")


def _short(words: list[str]) -> str:
    text = "".join(c if c.isprintable() else "?" for c in " ".join(words))
    return text if len(text) <= 40 else f"{text[:37]}..."


_READERS: dict[str, Callable[[_TextMesh, Iterator[_Line]], None]] = {
    "obj": _read_obj,
    "off": _read_off,
    "stl": _read_ascii_stl,
}
