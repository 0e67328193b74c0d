"""Wavefront OBJ files."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from graspbench.geometry.refusals import shortened
from graspbench.geometry.text_mesh import Block, Row, TextMesh, rows_of

_REFERENCE = re.compile(r"/\S*")
"""What a corner says of its texture and normal."""

_UNUSUAL = re.compile(r"^(?:[ \t]|[vf]\t)", re.MULTILINE)
"""A line that begins with a space, or whose first word ends in a tab."""


def read_obj(mesh: TextMesh, blocks: Iterator[Block]) -> None:
    """Read the v and f lines; a corner is v, v/vt, v//vn or v/vt/vn, from 1, or from -1 backwards."""
    for block in blocks:
        if _read_tables(mesh, block[1]):
            continue
        rows = rows_of(block, joined=True)
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
        mesh.add_polygons(polygons)


def _read_tables(mesh: TextMesh, text: str) -> bool:
    """Read a block whose vertices and faces are tables, which nearly all are; anything else is left alone."""
    if "\\" in text or _UNUSUAL.search(text):
        return False
    lines = text.split("\n")
    points = [line[2:] for line in lines if line[:2] == "v "]
    faces = [line[2:] for line in lines if line[:2] == "f "]
    try:
        # A table without a row has no number of columns.
        table = np.loadtxt(points, ndmin=2, comments=None) if points else np.zeros((0, 3))
        if faces and "/" in faces[0]:
            faces = [_REFERENCE.sub("", line) for line in faces]
        corners = np.loadtxt(faces, dtype=np.int64, ndmin=2, comments=None) if faces else np.zeros((0, 3))
    except (ValueError, OverflowError):
        return False
    if table.shape[1] < 3 or len(table) < len(points) or len(corners) < len(faces) or np.any(corners < 1):
        return False
    mesh.add_tables(table[:, :3], corners.astype(np.int64) - 1)
    return True


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
