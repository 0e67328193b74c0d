"""Handles of a closed surface: how thin the thinnest is, and how to cut the spurious ones of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.geometry import topology

_SPURIOUS_SHARE = 0.1
"""A handle or tunnel of a smaller girth, as share of the object's size, is a scan's error and no grip."""

_ROOTS = 4
_MAX_LOOPS = 24

_MARGIN = 1
"""Edges between two loops that are cut at once: the rims of both cuts are moved."""


def thinnest_loop(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, float]:
    """Return a short loop around or through a handle, and its length.

    The loops of :func:`handle_loops` depend on their root. So the next roots are spread over each of them,
    which the other loops of its handle must meet, as long as that shortens it: a local optimum.

    Args:
        vertices: Shape (n, 3).
        faces: One closed, oriented surface of genus 1 or more, shape (m, 3).

    Returns:
        The loop's vertices in order, shape (k,), and its length.
    """
    graph = _Graph.of(vertices, faces)
    thinnest = _thinnest(graph, handle_loops(graph, 0))
    return thinnest.vertices, thinnest.length


def _thinnest(graph: _Graph, loops: list[_Loop]) -> _Loop:
    return min((_tightened(graph, loop) for loop in loops[:_MAX_LOOPS]), key=lambda loop: loop.length)


def _tightened(graph: _Graph, loop: _Loop) -> _Loop:
    """Look for shorter loops from roots on a loop, and from roots on those, as long as that shortens it."""
    while True:
        spread = np.unique(np.linspace(0, len(loop.vertices) - 1, _ROOTS).astype(int))
        roots = [int(loop.vertices[k]) for k in spread]
        found = [other for root in roots for other in handle_loops(graph, root, 0.51 * loop.length)]
        closer = min(found, default=loop, key=lambda item: item.length)
        if closer.length >= loop.length * (1.0 - 1e-3):
            return loop
        loop = closer


def is_spurious(girth: float, vertices: FloatArray) -> bool:
    """Whether a handle of this girth is too thin, on an object of this size, to be meant."""
    return girth < _spurious_girth(vertices)


def _spurious_girth(vertices: FloatArray) -> float:
    return _SPURIOUS_SHARE * float(np.ptp(vertices, axis=0).max())


def cut_spurious_handles(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, list[float]]:
    """Cut handles and close tunnels that are too thin to be meant; both rims of each cut are left open.

    All those that stay clear of each other and together do not divide the surface are cut at once.

    Args:
        vertices: Shape (n, 3).
        faces: One closed, oriented surface, shape (m, 3).

    Returns:
        Vertices, triangles, and the lengths of the loops that were cut; none when no handle is spurious.
    """
    graph = _Graph.of(vertices, faces)
    limit = _spurious_girth(vertices)
    loops = handle_loops(graph, 0)
    if loops and loops[0].length >= limit:
        loops = [_thinnest(graph, loops)]
    thin = [loop for loop in loops if loop.length < limit]
    taken = np.zeros(len(vertices), dtype=bool)
    chosen: list[_Loop] = []
    for loop in thin:
        closer = loop if taken[loop.vertices].any() else _closest(graph, loop)
        if taken[closer.vertices].any() or not graph.holds_together([*chosen, closer]):
            continue
        chosen.append(closer)
        taken[closer.vertices] = True
        for _ in range(_MARGIN):
            taken[graph.weights[taken].indices] = True
    if chosen:
        vertices, faces = cut_open(vertices, faces, *(loop.vertices for loop in chosen))
    return vertices, faces, [loop.length for loop in chosen]


def cut_open(vertices: FloatArray, faces: IntArray, *loops: IntArray) -> tuple[FloatArray, IntArray]:
    """Cut a surface along loops and draw the two rims of each apart; closing both holes removes a handle.

    Args:
        vertices: Shape (n, 3).
        faces: Shape (m, 3).
        loops: Vertices of each in order, shapes (k,).
    """
    edges = topology.find_edges(faces, len(vertices))
    around = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    cut = np.isin(edges.ends @ [len(vertices), 1], np.sort(around, axis=1) @ [len(vertices), 1])
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


@dataclass(frozen=True)
class _Loop:
    vertices: IntArray
    length: float


@dataclass(frozen=True)
class _Graph:
    """A surface's edges with their lengths, as a sparse matrix too, and the two triangles at each."""

    vertices: FloatArray
    edges: topology.Edges
    lengths: FloatArray
    weights: csr_array
    triangles: IntArray
    n_faces: int

    @classmethod
    def of(cls, vertices: FloatArray, faces: IntArray) -> _Graph:
        edges = topology.find_edges(faces, len(vertices))
        lengths = np.linalg.norm(vertices[edges.ends[:, 0]] - vertices[edges.ends[:, 1]], axis=1)
        lengths = np.maximum(lengths, 1e-12 * lengths.max())  # a sparse matrix drops zeros
        triangles = np.empty((len(edges.count), 2), dtype=np.int64)
        triangles[edges.of_side.ravel()[edges.pairs[:, 0]]] = np.sort(edges.pairs // 3, axis=1)
        ends = np.concatenate([edges.ends, edges.ends[:, ::-1]]).T
        weights = csr_array((np.tile(lengths, 2), (ends[0], ends[1])), shape=(len(vertices),) * 2)
        return cls(vertices, edges, lengths, weights, triangles, len(faces))

    def holds_together(self, cuts: Sequence[_Loop]) -> bool:
        """Whether the surface stays in one piece when it is cut along loops."""
        around = [np.stack([loop.vertices, np.roll(loop.vertices, -1)], axis=1) for loop in cuts]
        codes = np.sort(np.concatenate(around), axis=1) @ [len(self.vertices), 1]
        kept = np.ones(len(self.triangles), dtype=bool)
        kept[np.searchsorted(self.edges.ends @ [len(self.vertices), 1], codes)] = False
        left, right = self.triangles[kept].T
        graph = csr_array((np.ones(len(left), dtype=np.int8), (left, right)), shape=(self.n_faces,) * 2)
        return int(connected_components(graph, directed=False)[0]) == 1


def handle_loops(graph: _Graph, root: int, within: float = np.inf) -> list[_Loop]:
    """Return two loops a handle, one around and one through it, the shortest first.

    From a root vertex the shortest paths form a tree; a spanning tree of the triangles that crosses none of
    them leaves two edges a handle, and each closes a loop that does not divide the surface (Erickson and
    Whittlesey 2005).

    Args:
        graph: One closed, oriented surface.
        root: A vertex.
        within: Return only loops through vertices that are closer to the root.
    """
    a, b = graph.edges.ends.T
    tree = dijkstra(graph.weights, indices=np.array([root]), return_predecessors=True, limit=within)
    distances, parents = tree[0][0], tree[1][0].astype(np.int64)
    free = np.flatnonzero((parents[a] != b) & (parents[b] != a))
    # The triangles' spanning tree takes the edges with the longest loops and leaves the shortest.
    through = distances[a[free]] + distances[b[free]] + graph.lengths[free]
    near = np.isfinite(through)
    order = free[near][np.argsort(-through[near], kind="stable")]
    left = _unspanned(
        np.concatenate([free[~near], order]), graph.triangles, graph.n_faces, int((~near).sum())
    )
    loops = [np.array(_loop(int(a[e]), int(b[e]), parents), dtype=np.int64) for e in left]
    return sorted(
        (_Loop(loop, _length(graph.vertices[loop])) for loop in loops), key=lambda loop: loop.length
    )


@compiled
def _unspanned(order: IntArray, triangles: IntArray, n_faces: int, first: int) -> IntArray:
    """Return the edges, from the first on, whose two triangles the edges before them connect already."""
    parent = np.arange(n_faces)
    left = []
    for k in range(len(order)):
        e = order[k]
        i, j = triangles[e]
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        while parent[j] != j:
            parent[j] = parent[parent[j]]
            j = parent[j]
        if i != j:
            parent[i] = j
        elif k >= first:
            left.append(e)
    return np.array(left, dtype=np.int64)


def _closest(graph: _Graph, loop: _Loop) -> _Loop:
    """Return the shortest loop through a vertex of a loop, or the loop itself."""
    near = handle_loops(graph, int(loop.vertices[0]), 0.51 * loop.length)
    return min(loop, *near, key=lambda item: item.length)


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).sum())


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
