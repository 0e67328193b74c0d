"""Connectivity of triangle sets: welding, bodies, orientation, vertex fans, genus.

All functions take plain arrays and are linear in the number of triangles, so that a mesh of millions
of triangles costs seconds and bounded memory.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from graspbench.arrays import BoolArray, FloatArray, IntArray

_WELD_SHARE = 1e-6
"""Vertices closer than this share of the mesh's size are one: beyond the seven digits of a float32 file."""


@dataclass(frozen=True)
class Edges:
    """The undirected edges of a triangle set.

    Attributes:
        count: Number of triangles at each edge, shape (n_e,).
        of_side: Edge of each triangle's side k (from corner k to k + 1), shape (m, 3).
        pairs: Sides (flat index 3 * triangle + k) that meet at an edge of exactly two triangles, (n_p, 2).
        same_way: Whether both triangles of a pair run along their edge in the same direction: at least one
            of them is turned inside out, shape (n_p,).
        ends: The two vertices of each edge, the smaller first, shape (n_e, 2).
    """

    count: IntArray
    of_side: IntArray
    pairs: IntArray
    same_way: BoolArray
    ends: IntArray


def weld(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Merge coinciding vertices, drop triangles that lose a corner or come twice, and unused vertices.

    Args:
        vertices: Shape (n, 3), finite.
        faces: Shape (m, 3).
    """
    size = float(np.ptp(vertices, axis=0).max(initial=0.0)) or 1.0
    # One number a vertex sorts much faster than rows do; 21 bits hold the 1e6 cells of an axis.
    cell = np.zeros(len(vertices), dtype=np.int64)
    for axis in range(3):  # one after the other, for the memory's sake
        offset = vertices[:, axis] - vertices[:, axis].min()
        cell = (cell << 21) | np.round(offset / (_WELD_SHARE * size)).astype(np.int64)
    _, first, label = np.unique(cell, return_index=True, return_inverse=True)
    del cell
    is_kept = np.zeros(len(vertices), dtype=bool)
    is_kept[first] = True
    merged = ((np.cumsum(is_kept) - 1)[first])[label][faces]
    kept = np.flatnonzero(is_kept)
    a, b, c = merged.T
    merged = merged[(a != b) & (b != c) & (c != a)]
    lowest = np.argmin(merged, axis=1)[:, None]
    canonical = np.take_along_axis(merged, (lowest + np.arange(3)) % 3, axis=1)
    return without_unused(vertices[kept], merged[_first_of_equal(canonical)])


def without_backs(faces: IntArray) -> IntArray:
    """Drop the second of two triangles that are each other's reverse, if all of them come in such pairs."""
    kept = _first_of_equal(np.sort(faces, axis=1))
    return faces[kept] if 2 * int(kept.sum()) == len(faces) else faces


def without_flaps(faces: IntArray) -> IntArray:
    """Drop both of two triangles that are each other's reverse: they enclose nothing."""
    order = np.lexsort(np.sort(faces, axis=1).T)
    corners = np.sort(faces, axis=1)[order]
    alike = np.all(corners[1:] == corners[:-1], axis=1)
    first = order[:-1][alike]  # equal triangles come once: two of these corners are of two directions
    kept = np.ones(len(faces), dtype=bool)
    kept[first] = kept[order[1:][alike]] = False
    return faces[kept]


def without_unused(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Drop the vertices that no triangle uses."""
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    return vertices[used], (np.cumsum(used) - 1)[faces]


def find_edges(faces: IntArray, vertex_count: int) -> Edges:
    """Return the edges of a triangle set."""
    start, end = faces, np.roll(faces, -1, axis=1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    keys, of_side, count = np.unique(
        (low * vertex_count + high).ravel(), return_inverse=True, return_counts=True
    )
    order = np.argsort(of_side, kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    twice = count == 2
    pairs = np.stack([order[first[twice]], order[first[twice] + 1]], axis=1)
    forward = (start < end).ravel()
    return Edges(
        count.astype(np.int64),
        of_side.reshape(-1, 3).astype(np.int64),
        pairs.astype(np.int64),
        forward[pairs[:, 0]] == forward[pairs[:, 1]],
        np.stack([keys // vertex_count, keys % vertex_count], axis=1).astype(np.int64),
    )


def part_at_edges(vertices: FloatArray, faces: IntArray, edges: Edges) -> Edges:
    """Return edges whose pairs include those of the triangles that enclose one wedge of solid each.

    Where an even number of triangles meets in one edge, bodies touch there, or one touches itself. Around the
    edge solid and void take turns, and the two triangles at the ends of a solid wedge belong together. Edges
    where they do not take turns are left alone.
    """
    flat_of_side = edges.of_side.ravel()
    members = np.flatnonzero((edges.count[flat_of_side] > 2) & (edges.count[flat_of_side] % 2 == 0))
    members = members[np.argsort(flat_of_side[members], kind="stable")]
    pairs = []
    for sides in np.split(members, np.flatnonzero(np.diff(flat_of_side[members])) + 1):
        if len(sides):
            pairs += _wedges(vertices, faces, edges.ends[flat_of_side[sides[0]]], sides)
    if not pairs:
        return edges
    return replace(
        edges,
        pairs=np.concatenate([edges.pairs, np.array(pairs, dtype=np.int64)]),
        same_way=np.concatenate([edges.same_way, np.zeros(len(pairs), dtype=bool)]),
    )


def _wedges(vertices: FloatArray, faces: IntArray, ends: IntArray, sides: IntArray) -> list[tuple[int, int]]:
    start, apex = faces[sides // 3, sides % 3], faces[sides // 3, (sides + 2) % 3]
    along = vertices[ends[1]] - vertices[ends[0]]
    along /= max(float(np.linalg.norm(along)), 1e-300)
    away = vertices[apex] - vertices[ends[0]]
    away = away - np.outer(away @ along, along)
    across = np.cross(along, away[0])
    order = np.argsort(np.arctan2(away @ across, away @ away[0]), kind="stable")
    forward = (start == ends[0])[order]
    if not np.all(forward != np.roll(forward, 1)):
        return []
    # Seen along the edge, the inside begins behind a backward triangle and ends at the forward one after it.
    first = int(np.argmin(forward))
    around = [int(side) for side in np.roll(sides[order], -first)]
    return list(zip(around[::2], around[1::2], strict=True))


def bodies(faces: IntArray, edges: Edges, *, only_pairs: bool = False) -> IntArray:
    """Return the body of each triangle, shape (m,): triangles that share an edge belong together.

    Args:
        faces: Triangles, shape (m, 3).
        edges: Their edges.
        only_pairs: Do not count edges of more than two triangles, where bodies touch or walls branch off.
    """
    if only_pairs:
        left, right = edges.pairs.T // 3
        pairs = coo_array((np.ones(len(left), dtype=np.int8), (left, right)), shape=(len(faces),) * 2)
        return _labels(pairs)
    triangle = np.repeat(np.arange(len(faces)), 3)
    graph = coo_array(
        (np.ones(3 * len(faces), dtype=np.int8), (triangle, len(faces) + edges.of_side.ravel())),
        shape=(len(faces) + len(edges.count),) * 2,
    )
    return _labels(graph)[: len(faces)]


def orient(faces: IntArray, edges: Edges) -> tuple[IntArray, int] | None:
    """Turn triangles so that neighbours agree on which side is out.

    The orientations are the two sheets of a double cover: a surface is orientable when no triangle is
    connected to its own reverse.

    Returns:
        The triangles, shape (m, 3), and how many were turned (at most half of each body); None for a
        surface with only one side.
    """
    if not edges.same_way.any():
        return faces, 0
    count = len(faces)
    left, right = edges.pairs[:, 0] // 3, edges.pairs[:, 1] // 3
    swap = edges.same_way.astype(np.int64) * count
    rows = np.concatenate([left, left + count])
    columns = np.concatenate([right + swap, right + count - swap])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(2 * count, 2 * count))
    sheet = _labels(graph)
    upper, lower = sheet[:count], sheet[count:]
    if np.any(upper == lower):
        return None
    turned = upper > lower
    # Either choice is consistent; keep the one that turns fewer triangles of each body.
    body = np.minimum(upper, lower)
    share = np.bincount(body, weights=turned) / np.maximum(np.bincount(body), 1)
    turned ^= (share > 0.5)[body]
    result = faces.copy()
    result[turned] = result[turned][:, ::-1]
    return result, int(turned.sum())


def split_fans(vertices: FloatArray, faces: IntArray, edges: Edges) -> tuple[FloatArray, IntArray, int]:
    """Give each fan of triangles around a vertex a vertex of its own.

    Where two cones touch in one point, that point is one vertex of two fans: the surface is pinched.

    Returns:
        Vertices, triangles, and the number of vertices that were pinched.
    """
    flat = np.arange(faces.size)
    left, right = edges.pairs[:, 0], edges.pairs[:, 1]
    left_next, right_next = _next_corner(left), _next_corner(right)
    # Two triangles run along a shared edge in opposite directions, unless one is turned.
    rows = np.concatenate([left, left_next])
    columns = np.where(
        np.concatenate([edges.same_way, edges.same_way]),
        np.concatenate([right, right_next]),
        np.concatenate([right_next, right]),
    )
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(faces.size,) * 2)
    fan = _labels(graph)
    owner = np.zeros(int(fan.max(initial=-1)) + 1, dtype=np.int64)
    owner[fan] = faces.ravel()[flat]
    pinched = int(np.sum(np.bincount(owner, minlength=len(vertices)) > 1))
    if pinched == 0:
        return vertices, faces, 0
    return vertices[owner], fan.reshape(-1, 3).astype(np.int64), pinched


def genus(vertex_count: int, face_count: int) -> int:
    """Return the number of handles of one closed surface without pinched vertices: V - E + F = 2 - 2 g."""
    return (2 - vertex_count + face_count // 2) // 2  # a closed surface has 3/2 edges a triangle


def _next_corner(flat: IntArray) -> IntArray:
    following: IntArray = np.where(flat % 3 == 2, flat - 2, flat + 1)
    return following


def _first_of_equal(rows: IntArray) -> BoolArray:
    """Return which rows, shape (m, 3), come for the first time, shape (m,)."""
    order = np.lexsort(rows.T)  # stable: the first of equals stays first
    ordered = rows[order]
    first = np.ones(len(rows), dtype=bool)
    first[order[1:]] = np.any(ordered[1:] != ordered[:-1], axis=1)
    return first


def _labels(graph: "coo_array") -> IntArray:
    labels = connected_components(graph, directed=False)[1]
    return np.asarray(labels, dtype=np.int64)
