"""Networks of the reconstruction surface: any closed mesh, and the thesis' meridians and parallels."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from graspbench.arrays import IntArray
from graspbench.compiled import compiled


@dataclass(frozen=True, eq=False)
class SurfaceNetwork:
    """Nodes of a closed, orientable surface of any genus and how they are linked.

    Attributes:
        link_start: Offsets into `link_nodes`, shape (n_s + 1,).
        link_nodes: Spring neighbours of node a at ``link_nodes[link_start[a]:link_start[a + 1]]``.
        contour_start: Offsets into `contour_nodes`, shape (n_s + 1,).
        contour_nodes: The closed contour of neighbours around each node, in cyclic order, counter-clockwise
            seen from outside.
        faces: Outward oriented triangles, shape (n_faces, 3).
    """

    link_start: IntArray
    link_nodes: IntArray
    contour_start: IntArray
    contour_nodes: IntArray
    faces: IntArray

    @property
    def size(self) -> int:
        """Number of nodes n_s."""
        return len(self.contour_start) - 1

    @property
    def genus(self) -> int:
        """Number of handles: V - E + F = 2 - 2 g, and every face has three half-edges."""
        return (2 - self.size + len(self.faces) // 2) // 2

    def contour(self, node: int) -> IntArray:
        """Return the contour nodes around ``node``."""
        return self.contour_nodes[self.contour_start[node] : self.contour_start[node + 1]]


@dataclass(frozen=True, eq=False)
class SphereNetwork(SurfaceNetwork):
    """The thesis' sphere-like network (3.3.1, figure 3.6).

    Node 0 is the north pole; node 1 + j * meridians + i lies on parallel j (0 is the northernmost)
    and meridian i (cyclic); the last node is the south pole. A node has 4 links (n_m at a pole) and a contour
    of 8 (n_m at a pole).

    Attributes:
        meridians: Number of meridians n_m.
        parallels: Number of parallels n_p, poles excluded.
    """

    meridians: int
    parallels: int


def quad_network(quads: IntArray, faces: IntArray, size: int) -> SurfaceNetwork:
    """Return the network of a mesh of quadrilaterals: links along sides, contours around all they touch.

    Where four quadrilaterals meet, a node has 4 links and a contour of 8, as in the thesis.

    Args:
        quads: A closed surface: each side in two quadrilaterals that pass it in opposite directions, one fan
            of them around each node; shape (n_quads, 4).
        faces: The quadrilaterals cut in two triangles each, shape (2 n_quads, 3).
        size: Number of nodes, each of them in some quadrilateral.
    """
    count = np.bincount(quads.ravel(), minlength=size)
    link_start = np.concatenate(([0], np.cumsum(count))).astype(np.int64)
    links = np.empty(quads.size, dtype=np.int64)
    contours = np.empty(2 * quads.size, dtype=np.int64)
    contour_start = 2 * link_start
    triangles = np.ascontiguousarray(faces, dtype=np.int64)
    _order_rings(np.ascontiguousarray(quads, dtype=np.int64), link_start, links, contours)
    for array in (link_start, links, contour_start, contours, triangles):
        array.setflags(write=False)
    return SurfaceNetwork(link_start, links, contour_start, contours, triangles)


@compiled
def _order_rings(quads: IntArray, start: IntArray, links: IntArray, contours: IntArray) -> None:
    """Fill the rings around all nodes, counter-clockwise seen from outside."""
    size = len(start) - 1
    filled = np.zeros(size, dtype=np.int64)
    opposite, following = np.empty_like(links), np.empty_like(links)
    for f in range(len(quads)):
        for k in range(4):
            a = quads[f, k]
            slot = start[a] + filled[a]
            links[slot] = quads[f, (k + 1) % 4]
            opposite[slot], following[slot] = quads[f, (k + 2) % 4], quads[f, (k + 3) % 4]
            filled[a] += 1
    for a in range(size):
        first, end = start[a], start[a + 1]
        for slot in range(first, end):
            for other in range(slot + 1, end):
                if slot + 1 < end and links[other] == following[slot]:
                    for array in (links, opposite, following):
                        array[slot + 1], array[other] = array[other], array[slot + 1]
                    break
            contours[2 * slot], contours[2 * slot + 1] = links[slot], opposite[slot]


@lru_cache(maxsize=32)
def build_network(meridians: int, parallels: int) -> SphereNetwork:
    """Build the network of ``meridians`` x ``parallels`` nodes and two poles.

    Args:
        meridians: At least 3.
        parallels: At least 1.
    """
    south = meridians * parallels + 1

    def node(i: int, j: int) -> int:
        if j < 0:
            return 0
        if j >= parallels:
            return south
        return 1 + j * meridians + i % meridians

    rings = {0: [node(i, 0) for i in range(meridians)]}
    rings[south] = [node(i, parallels - 1) for i in reversed(range(meridians))]
    links, contours = dict(rings), dict(rings)
    for j in range(parallels):
        for i in range(meridians):
            here = node(i, j)
            links[here] = [node(i + 1, j), node(i, j - 1), node(i - 1, j), node(i, j + 1)]
            around = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)]
            contours[here] = list(dict.fromkeys(node(i + di, j + dj) for di, dj in around))

    faces = []
    for i in range(meridians):
        faces.append((0, node(i, 0), node(i + 1, 0)))
        faces.append((south, node(i + 1, parallels - 1), node(i, parallels - 1)))
        for j in range(parallels - 1):
            a, b = node(i, j), node(i + 1, j)
            c, d = node(i, j + 1), node(i + 1, j + 1)
            faces += [(a, c, d), (a, d, b)]

    link_start, link_nodes = _compress(links, south + 1)
    contour_start, contour_nodes = _compress(contours, south + 1)
    triangles = np.array(faces, dtype=np.int64)
    for array in (link_start, link_nodes, contour_start, contour_nodes, triangles):
        array.setflags(write=False)
    return SphereNetwork(
        link_start, link_nodes, contour_start, contour_nodes, triangles, meridians, parallels
    )


def _compress(lists: dict[int, list[int]], size: int) -> tuple[IntArray, IntArray]:
    """Store one list a node as offsets and one flat array."""
    counts = [len(lists[a]) for a in range(size)]
    start = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    return start, np.array([b for a in range(size) for b in lists[a]], dtype=np.int64)
