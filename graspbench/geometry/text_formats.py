"""Mesh files of plain text, read block by block: Wavefront OBJ, OFF and STL in ASCII.

Coordinates go into flat arrays of machine numbers, so that a file takes little more memory than its mesh,
and every complaint names a line or a face.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import chain, islice
from pathlib import Path

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry.obj_format import read_obj
from graspbench.geometry.refusals import MAX_VERTICES, announced, shortened
from graspbench.geometry.text_mesh import Block, Row, TextMesh, blocks_of, rows_of

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
        _READERS[suffix](mesh, blocks_of(text, mesh, joined=suffix == "obj"))
    return mesh.arrays()


def _read_off(mesh: TextMesh, blocks: Iterator[Block]) -> None:
    """Read the counts, the vertices, and the polygons with their numbers of corners."""
    rows = chain.from_iterable(rows_of(block) for block in blocks)
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
        mesh.add_polygons([_counted_corners(mesh, *row) for row in some])


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


def _read_ascii_stl(mesh: TextMesh, blocks: Iterator[Block]) -> None:
    """Read the vertices between each facet's outer loop and endloop."""
    inside, first, n_vertices = False, 0, 0
    for block in blocks:
        points, polygons = [], []
        for row in rows_of(block):
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


_READERS: dict[str, Callable[[TextMesh, Iterator[Block]], None]] = {
    "obj": read_obj,
    "off": _read_off,
    "stl": _read_ascii_stl,
}
