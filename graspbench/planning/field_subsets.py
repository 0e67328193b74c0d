"""Compiled moves of several contacts at once: every combination of their contour points."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.planning.field import potential


@inner
def distinct(vertices: IntArray) -> bool:
    """Tell whether no two contacts share a vertex."""
    for i in range(len(vertices)):
        for j in range(i):
            if vertices[i] == vertices[j]:
                return False
    return True


@inner
def _try_subset(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    below: float,
    fingers: IntArray,
    vertices: IntArray,
    found: IntArray,
) -> float:
    """Write the best positions of some contacts on their contours; return the potential, or ``below``."""
    width = moves.shape[1]
    standing = 0.0
    points = np.empty((len(vertices), 3))
    chosen = vertices.copy()
    for i in range(len(vertices)):
        standing += walls[i, 0]
        for a in range(3):
            points[i, a] = nodes_points[vertices[i], a]
    for i in fingers:
        standing -= walls[i, 0]
    best = below
    for combination in range(width ** len(fingers)):
        rest, value, allowed = combination, standing, True
        for i in fingers:
            column = rest % width
            rest //= width
            node = moves[i, column]
            if node < 0:
                allowed = False
                break
            value += walls[i, column]
            chosen[i] = node
            for a in range(3):
                points[i, a] = nodes_points[node, a]
        if not allowed or not distinct(chosen):
            continue
        value += potential(points, centroid, k, radius)
        if value < best:
            best = value
            for i in range(len(vertices)):
                found[i] = chosen[i]
    return best


@inner
def try_subsets(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    below: float,
    vertices: IntArray,
) -> bool:
    """Move the two contacts that lower the potential most; if none do, all three of three."""
    n_f = len(vertices)
    best, found = below, vertices.copy()
    fingers = np.empty(2, dtype=np.int64)
    for i in range(n_f):
        for j in range(i + 1, n_f):
            fingers[0], fingers[1] = i, j
            best = _try_subset(
                nodes_points, centroid, moves, walls, k, radius, best, fingers, vertices, found
            )
    # With more fingers triples cost too much for what they find.
    if best >= below and n_f == 3 and moves.shape[1] <= 9:
        best = _try_subset(
            nodes_points, centroid, moves, walls, k, radius, best, np.arange(3), vertices, found
        )
    if best >= below:
        return False
    for i in range(n_f):
        vertices[i] = found[i]
    return True
