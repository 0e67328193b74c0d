"""How far contacts reach in directions of a planar wrench space: bounds of Q3, and of force closure."""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.planning.search.planar_wrenches import contact_basis
from graspbench.planning.search.polar import weak_direction

WALKS = 2
"""Directions of the table from which a weak one is looked for."""


@inner
def _support(
    frame: FloatArray,
    turn: float,
    normal: FloatArray,
    arm: FloatArray,
    vertices: FloatArray,
    direction: FloatArray,
) -> float:
    """Return no less than the support of a contact whose normal and arm may be turned by as much as ``turn``.

    A wrench's product with the direction is that of its force with g, the direction's own force plus its
    moment's turn at the arm. Turned normals have turned corners, and all of them are in the circular cone.
    """
    d = direction.shape[0]
    g = np.empty(3)
    moment = direction[2] if d == 3 else 0.0
    square, along, reach, tilt = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        g[k] = direction[0] * frame[0, k] + direction[1] * frame[1, k]
        g[k] += moment * (frame[2, a] * arm[b] - frame[2, b] * arm[a])
        square += g[k] * g[k]
        along += g[k] * normal[k]
        reach += arm[k] * arm[k]
        tilt += frame[2, k] * normal[k]
    size, reach = math.sqrt(square), math.sqrt(reach)
    if vertices.shape[1] == 1:
        return float(along + turn * (size + abs(moment) * reach))
    friction, twist = 0.0, 0.0
    for v in range(vertices.shape[0]):
        friction = max(friction, math.hypot(vertices[v, 0], vertices[v, 1]))
        if vertices.shape[1] == 4:
            twist = max(twist, abs(vertices[v, 3] * moment))
    longest = math.sqrt(1.0 + friction * friction)
    across = math.sqrt(max(square - along * along, 0.0))
    cone = along + friction * across + turn * longest * (size + abs(moment) * reach)
    cone += twist * (abs(tilt) + turn)
    edges = vertices.shape[0] // 2 if vertices.shape[1] == 4 else vertices.shape[0]
    basis = np.empty((3, 3))
    sine = contact_basis(frame, normal, basis)
    if edges % 2 == 1 or sine <= max(1e-3, 4.0 * turn):
        return float(cone)  # which way the first edge points is not known well enough
    corners = -np.inf
    for v in range(vertices.shape[0]):
        value = 0.0
        for j in range(3):
            for k in range(3):
                value += vertices[v, j] * basis[j, k] * g[k]
        if vertices.shape[1] == 4:
            value += vertices[v, 3] * moment * tilt
        corners = max(corners, value)
    swing = turn + friction * (turn + 3.0 * turn / sine)
    corners += swing * size + turn * longest * abs(moment) * reach + twist * turn
    return float(min(cone, corners))


@inner
def support_bound(
    clusters: IntArray,
    tree: IntArray,
    frame: FloatArray,
    turn: float,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    wrenches: FloatArray,
    minkowski: bool,
    floor: float,
) -> float:
    """Return an upper bound of Q3, from directions in which the representative's wrenches are weak."""
    n_f, d = clusters.shape[0], directions.shape[1]
    direction, best, last = np.empty(d), np.inf, -1
    for walk in range(WALKS + 1):
        lowest, weakest = np.inf, -1
        if walk < WALKS:
            for j in range(directions.shape[0]):
                reach = _reach(wrenches, n_f, directions[j], minkowski)
                near = 0.0
                if last >= 0:
                    for k in range(d):
                        near += directions[j, k] * directions[last, k]
                if reach < lowest and near < 0.7:
                    lowest, weakest = reach, j
            if weakest < 0:
                continue
            for k in range(d):
                direction[k] = directions[weakest, k]
            last = weakest
            if not minkowski and lowest > 0.0:
                weak_direction(wrenches, wrenches.shape[0], direction)
        else:  # where the contacts push together
            square = 0.0
            for k in range(d):
                direction[k] = 0.0
                for j in range(wrenches.shape[0]):
                    direction[k] += wrenches[j, k]
                square += direction[k] ** 2
            if square < 1e-20:
                continue
            for k in range(d):
                direction[k] /= -math.sqrt(square)
        value = 0.0 if minkowski else -np.inf
        for i in range(n_f):
            largest = -np.inf
            for node in range(tree[clusters[i], 2], tree[clusters[i], 3]):
                largest = max(largest, _support(frame, turn, normals[node], arms[node], vertices, direction))
            value = value + max(largest, 0.0) if minkowski else max(value, largest)
        best = min(best, value)
        if best <= floor:
            break
    return best


@inner
def _reach(wrenches: FloatArray, n_f: int, direction: FloatArray, minkowski: bool) -> float:
    """Return the support of single contacts' wrenches in a direction."""
    n_v = wrenches.shape[0] // n_f
    total = 0.0 if minkowski else -np.inf
    for i in range(n_f):
        farthest = -np.inf
        for v in range(i * n_v, (i + 1) * n_v):
            value = 0.0
            for k in range(direction.shape[0]):
                value += wrenches[v, k] * direction[k]
            farthest = max(farthest, value)
        total = total + max(farthest, 0.0) if minkowski else max(total, farthest)
    return float(total)


@inner
def least_support(
    wrenches: FloatArray, n_f: int, directions: FloatArray, minkowski: bool, floor: float
) -> float:
    """Return an upper bound of a single grasp's Q3."""
    lowest, weakest = np.inf, 0
    for j in range(directions.shape[0]):
        reach = _reach(wrenches, n_f, directions[j], minkowski)
        if reach < lowest:
            lowest, weakest = reach, j
            if lowest <= floor:
                return float(lowest)
    if not minkowski and lowest > 0.0:
        direction = directions[weakest].copy()
        weak_direction(wrenches, wrenches.shape[0], direction)
        lowest = min(lowest, _reach(wrenches, n_f, direction, minkowski))
    return float(lowest)
