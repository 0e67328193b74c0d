"""The network of the reconstruction surface: meridians, parallels and two poles."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from graspbench.arrays import IntArray


@dataclass(frozen=True, eq=False)
class SurfaceNetwork:
    """Links between the nodes of a sphere-like surface (thesis 3.3.1, figure 3.6).

    Node 0 is the north pole; node 1 + j * meridians + i lies on parallel j (0 is the northernmost)
    and meridian i (cyclic); the last node is the south pole.

    Attributes:
        meridians: Number of meridians n_m.
        parallels: Number of parallels n_p, poles excluded.
        link_start: Offsets into `link_nodes`, shape (n_s + 1,).
        link_nodes: Spring neighbours (4 a node, n_m for a pole) of node a at
            ``link_nodes[link_start[a]:link_start[a + 1]]``.
        contour_start: Offsets into `contour_nodes`, shape (n_s + 1,).
        contour_nodes: The closed contour of neighbours around each node (8 in the interior, in cyclic
            order, counter-clockwise seen from outside; n_m for a pole).
        faces: Outward oriented triangles, shape (n_faces, 3).
    """

    meridians: int
    parallels: int
    link_start: IntArray
    link_nodes: IntArray
    contour_start: IntArray
    contour_nodes: IntArray
    faces: IntArray

    @property
    def size(self) -> int:
        """Number of nodes n_s."""
        return self.meridians * self.parallels + 2

    def contour(self, node: int) -> IntArray:
        """Return the contour nodes around ``node``."""
        return self.contour_nodes[self.contour_start[node] : self.contour_start[node + 1]]


@lru_cache(maxsize=32)
def build_network(meridians: int, parallels: int) -> SurfaceNetwork:
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
    return SurfaceNetwork(
        meridians, parallels, link_start, link_nodes, contour_start, contour_nodes, triangles
    )


def _compress(lists: dict[int, list[int]], size: int) -> tuple[IntArray, IntArray]:
    """Store one list a node as offsets and one flat array."""
    counts = [len(lists[a]) for a in range(size)]
    start = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    return start, np.array([b for a in range(size) for b in lists[a]], dtype=np.int64)
