"""Handles of a closed surface: how thin the thinnest is, and how to cut the spurious ones of a scan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.geometry import topology

_SPURIOUS_SHARE = 0.1
"""A handle or tunnel of a smaller girth, as share of the object's size, is a scan's error and no grip."""

_ROOTS = 12
_ROUNDS = 4


def thinnest_loop(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, float]:
    """Return a short loop around or through a handle, and its length.

    From a root vertex the shortest paths form a tree; a spanning tree of the triangles that crosses none of
    them leaves two edges a handle, and each closes a loop that does not divide the surface (Erickson and
    Whittlesey 2005). The next roots are spread over the shortest of them, which the other loops of its handle
    must meet, as long as that shortens it: the result is a local optimum.

    Args:
        vertices: Shape (n, 3).
        faces: One closed, oriented surface of genus 1 or more, shape (m, 3).

    Returns:
        The loop's vertices in order, shape (k,), and its length.
    """
    edges = topology.find_edges(faces, len(vertices))
    lengths = np.linalg.norm(vertices[edges.ends[:, 0]] - vertices[edges.ends[:, 1]], axis=1)
    lengths = np.maximum(lengths, 1e-12 * lengths.max())  # a sparse matrix drops zeros
    best, girth = _shortest_from(0, edges, lengths, vertices, len(faces))
    for _ in range(_ROUNDS):
        spread = np.unique(np.linspace(0, len(best) - 1, _ROOTS).astype(int))
        found = [_shortest_from(int(best[k]), edges, lengths, vertices, len(faces)) for k in spread]
        loop, length = min(found, key=lambda item: item[1])
        if length >= girth * (1.0 - 1e-9):
            break
        best, girth = loop, length
    return best, girth


def is_spurious(girth: float, vertices: FloatArray) -> bool:
    """Whether a handle of this girth is too thin, on an object of this size, to be meant."""
    return girth < _SPURIOUS_SHARE * float(np.ptp(vertices, axis=0).max())


def cut_open(vertices: FloatArray, faces: IntArray, loop: IntArray) -> tuple[FloatArray, IntArray]:
    """Cut a surface along a loop and draw the two rims apart; closing both holes removes a handle.

    Args:
        vertices: Shape (n, 3).
        faces: Shape (m, 3).
        loop: Vertices in order, shape (k,).
    """
    edges = topology.find_edges(faces, len(vertices))
    low, high = np.minimum(loop, np.roll(loop, -1)), np.maximum(loop, np.roll(loop, -1))
    cut = np.isin(edges.ends @ [len(vertices), 1], low * len(vertices) + high)
    crossed = cut[edges.of_side.ravel()[edges.pairs[:, 0]]]
    uncut = replace(edges, pairs=edges.pairs[~crossed], same_way=edges.same_way[~crossed])
    vertices, faces, _ = topology.split_fans(vertices, faces, uncut)
    edges = topology.find_edges(faces, len(vertices))
    on_rim = np.zeros(len(vertices), dtype=bool)
    on_rim[edges.ends[edges.count == 1]] = True
    return _drawn_in(vertices, edges.ends, on_rim), faces


def _drawn_in(vertices: FloatArray, ends: IntArray, on_rim: BoolArray) -> FloatArray:
    """Move the vertices of a rim a quarter of the way to their neighbours inside the surface."""
    sums, counts = np.zeros_like(vertices), np.zeros(len(vertices))
    for here, there in (ends.T, ends[:, ::-1].T):
        inwards = on_rim[here] & ~on_rim[there]
        np.add.at(sums, here[inwards], vertices[there[inwards]])
        np.add.at(counts, here[inwards], 1.0)
    moved = vertices.copy()
    some = counts > 0
    moved[some] = 0.75 * vertices[some] + 0.25 * sums[some] / counts[some, None]
    return moved


def _shortest_from(
    root: int, edges: topology.Edges, lengths: FloatArray, vertices: FloatArray, n_faces: int
) -> tuple[IntArray, float]:
    a, b = edges.ends.T
    n_vertices = len(vertices)
    graph = csr_array((lengths, (a, b)), shape=(n_vertices, n_vertices))
    all_distances, all_parents = dijkstra(graph, directed=False, indices=[root], return_predecessors=True)
    distances, parents = all_distances[0], all_parents[0].astype(np.int64)
    in_tree = (parents[a] == b) | (parents[b] == a)
    through = distances[a] + distances[b] + lengths
    # The triangles' spanning tree takes the edges with the longest loops and leaves the shortest.
    left, right = edges.pairs.T // 3
    of_pair = edges.of_side.ravel()[edges.pairs[:, 0]]
    free = ~in_tree[of_pair]
    left, right, of_pair = left[free], right[free], of_pair[free]
    weights = through.max() * 1.001 - through[of_pair]
    dual = csr_array((weights, (left, right)), shape=(n_faces, n_faces))
    spanning = minimum_spanning_tree(dual).tocoo()
    taken = set(zip(spanning.row.tolist(), spanning.col.tolist(), strict=True))
    loops = [
        _loop(int(a[e]), int(b[e]), parents)
        for f, g, e in zip(left.tolist(), right.tolist(), of_pair.tolist(), strict=True)
        if (f, g) not in taken and (g, f) not in taken
    ]

    def length(loop: list[int]) -> float:
        points = vertices[loop]
        return float(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).sum())

    shortest = min(loops, key=length)
    return np.array(shortest, dtype=np.int64), length(shortest)


def _loop(first: int, last: int, parents: IntArray) -> list[int]:
    """Return the loop of an edge and the tree paths from its ends up to where they meet."""
    up, known = [first], {first: 0}
    while parents[up[-1]] >= 0:
        known[int(parents[up[-1]])] = len(up)
        up.append(int(parents[up[-1]]))
    down = [last]
    while down[-1] not in known:
        down.append(int(parents[down[-1]]))
    return up[: known[down[-1]]] + down[::-1]
