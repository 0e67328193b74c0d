"""Holes of a surface, closed with fans."""

from __future__ import annotations

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry import topology


def close_holes(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, int, float]:
    """Close every hole of one body with a fan; return also their number and the widest one's size."""
    edges = topology.find_edges(faces, len(vertices))
    side, corner = np.nonzero(edges.count[edges.of_side] == 1)
    loops = _simple_loops(faces[side, (corner + 1) % 3], faces[side, corner])
    if loops:
        rims = [vertices[loop] for loop in loops]
        centres = len(vertices) + np.arange(len(loops))
        fans = [
            np.stack([loop, np.roll(loop, -1), np.full(len(loop), centre)], axis=1)
            for loop, centre in zip(loops, centres, strict=True)
        ]
        vertices = np.concatenate([vertices, [rim.mean(axis=0) for rim in rims]])
        faces = np.concatenate([faces, *fans])
    widest = max((float(np.ptp(rim, axis=0).max()) for rim in rims), default=0.0) if loops else 0.0
    vertices, faces, _ = topology.split_fans(vertices, faces, topology.find_edges(faces, len(vertices)))
    return vertices, faces, len(loops), widest


def _simple_loops(start: IntArray, end: IntArray) -> list[IntArray]:
    """Return the closed loops of directed edges, none of which passes a vertex twice."""
    following: dict[int, list[int]] = {}
    for a, b in zip(start.tolist(), end.tolist(), strict=True):
        following.setdefault(a, []).append(b)
    loops: list[IntArray] = []
    for first in list(following):
        while following[first]:
            path, position = [first], {first: 0}
            while following.get(path[-1]):
                vertex = following[path[-1]].pop()
                if vertex in position:  # a hole ends here, though its rim may touch the next one's
                    loop = path[position[vertex] :]
                    loops.append(np.array(loop, dtype=np.int64))
                    for passed in loop[1:]:
                        del position[passed]
                    del path[position[vertex] + 1 :]
                else:
                    position[vertex] = len(path)
                    path.append(vertex)
    return loops
