"""Self-intersections of a triangle mesh."""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled

_PLANE_SHARE = 1e-9
"""Distances below this share of the mesh's size are touching, not piercing."""


def self_intersections(vertices: FloatArray, faces: IntArray, among: BoolArray | None = None) -> BoolArray:
    """Return which triangles are pierced by an edge of a triangle that is not their neighbour, shape (m,).

    Candidates come from a uniform grid; a triangle that lies flat on another one is not found.

    Args:
        vertices: Shape (n, 3).
        faces: Shape (m, 3); corners that coincide must be one vertex.
        among: Which triangles to look at, together with those they meet, shape (m,); None for all.
    """
    corners = np.ascontiguousarray(vertices[faces])
    low, high = corners.min(axis=1), corners.max(axis=1)
    origin, size = low.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cell = max(2.0 * float(np.median((high - low).max(axis=1))), size / 200.0)
    # Few huge triangles among many small ones would fill the whole grid: coarsen until they do not.
    while True:
        first = ((low - origin) / cell).astype(np.int64)
        last = ((high - origin) / cell).astype(np.int64)
        spans = np.prod(last - first + 1, axis=1)
        if spans.sum() <= 30 * len(faces) + 1000 or cell > size:
            break
        cell *= 1.5
    shape = last.max(axis=0) + 1
    cells, owners = _entries(first, last, shape, int(spans.sum()))
    order = np.argsort(cells, kind="stable")
    among = np.ones(len(faces), dtype=bool) if among is None else among
    tolerance = _PLANE_SHARE * size
    hit: BoolArray = _pierced(vertices, faces, low, high, cells[order], owners[order], among, tolerance)
    return hit


@compiled
def _entries(first: IntArray, last: IntArray, shape: IntArray, total: int) -> tuple[IntArray, IntArray]:
    """List (cell, triangle) for every cell that a triangle's box overlaps."""
    cells = np.empty(total, np.int64)
    owners = np.empty(total, np.int64)
    k = 0
    for t in range(len(first)):
        for i in range(first[t, 0], last[t, 0] + 1):
            for j in range(first[t, 1], last[t, 1] + 1):
                for h in range(first[t, 2], last[t, 2] + 1):
                    cells[k] = (i * shape[1] + j) * shape[2] + h
                    owners[k] = t
                    k += 1
    return cells, owners


@compiled
def _pierced(
    vertices: FloatArray,
    faces: IntArray,
    low: FloatArray,
    high: FloatArray,
    cells: IntArray,
    owners: IntArray,
    among: BoolArray,
    tolerance: float,
) -> BoolArray:
    hit = np.zeros(len(faces), np.bool_)
    start = 0
    while start < len(cells):
        end = start
        while end < len(cells) and cells[end] == cells[start]:
            end += 1
        for p in range(start, end):
            a = owners[p]
            for q in range(p + 1, end):
                b = owners[q]
                if (hit[a] and hit[b]) or not (among[a] or among[b]):
                    continue
                apart = False
                for k in range(3):
                    if low[a, k] > high[b, k] or low[b, k] > high[a, k]:
                        apart = True
                if apart:
                    continue
                if _edge_pierces(vertices, faces[a], faces[b], tolerance) or _edge_pierces(
                    vertices, faces[b], faces[a], tolerance
                ):
                    hit[a] = True
                    hit[b] = True
        start = end
    return hit


@compiled
def _edge_pierces(vertices: FloatArray, edges_of: IntArray, triangle: IntArray, tolerance: float) -> bool:
    """Whether an edge of one triangle that shares no corner with another one passes through it.

    Its border counts: in symmetric meshes edges cross edges exactly.
    """
    a, b, c = vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]
    normal = np.cross(b - a, c - a)
    length = np.sqrt(np.sum(normal * normal))
    if length == 0.0:
        return False
    normal /= length
    for k in range(3):
        i, j = edges_of[k], edges_of[(k + 1) % 3]
        if i == triangle[0] or i == triangle[1] or i == triangle[2]:
            continue
        if j == triangle[0] or j == triangle[1] or j == triangle[2]:
            continue
        from_plane = np.sum((vertices[i] - a) * normal)
        to_plane = np.sum((vertices[j] - a) * normal)
        if not (
            (from_plane > tolerance and to_plane < -tolerance)
            or (from_plane < -tolerance and to_plane > tolerance)
        ):
            continue
        point = vertices[i] + from_plane / (from_plane - to_plane) * (vertices[j] - vertices[i])
        inside = True
        for side in range(3):
            p = vertices[triangle[side]]
            edge = vertices[triangle[(side + 1) % 3]] - p
            inwards = np.cross(normal, edge)
            if np.sum(inwards * (point - p)) < -tolerance * np.sqrt(np.sum(edge * edge)):
                inside = False
        if inside:
            return True
    return False
