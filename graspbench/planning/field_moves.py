"""Compiled moves of the contacts along the force field, down its potential."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.field import field, potential
from graspbench.planning.field_subsets import distinct, try_subsets


@compiled
def propose_moves(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    barrier_force: FloatArray,
    k: FloatArray,
    sigma_f: float,
    radius: float,
    thorough: bool,
    vertices: IntArray,
) -> bool:
    """Write the next vertices and return True, or return False at a local optimum.

    Args:
        nodes_points: Surface nodes, shape (n_s, 3).
        nodes_normals: Their outward unit normals, shape (n_s, 3).
        centroid: Centroid, shape (3,).
        moves: Where each contact may go, -1 for nowhere; column 0 is to stay, shape (n_f, width).
        walls: See `barrier_potential`, shape (n_f, width).
        barrier_force: What the barrier pushes each contact with, N, shape (n_f, 3).
        k: Coefficients of the potential.
        sigma_f: Force below which a contact stays, N.
        radius: Mean radius of the surface, m.
        thorough: Whether several contacts may move together.
        vertices: The contacts; overwritten, shape (n_f,).
    """
    n_f, width = moves.shape
    points = np.empty((n_f, 3))
    for i in range(n_f):
        for a in range(3):
            points[i, a] = nodes_points[vertices[i], a]
    here = potential(points, centroid, k, radius)
    # Values below this are rounding, not progress.
    least = 1e-9 * (abs(here) + k[3] * radius)
    for i in range(n_f):
        here += walls[i, 0]

    order = _preferred_moves(
        nodes_points, nodes_normals, centroid, moves, barrier_force, k, sigma_f, points, vertices
    )
    if _try_together(nodes_points, centroid, moves, walls, k, radius, order, here - least, points, vertices):
        return True
    if _try_alone(nodes_points, centroid, moves, walls, k, radius, order, here - least, points, vertices):
        return True
    if not thorough or width < 2:
        return False
    return bool(try_subsets(nodes_points, centroid, moves, walls, k, radius, here - least, vertices))


@compiled
def barrier_potential(nodes_points: FloatArray, moves: IntArray, barrier: FloatArray) -> FloatArray:
    """Return the barrier's share of the potential at every move: its value times the contour's spacing."""
    n_f, width = moves.shape
    walls = np.zeros((n_f, width))
    for i in range(n_f):
        spacing, count = 0.0, 0
        for c in range(1, width):
            if moves[i, c] >= 0:
                square = 0.0
                for a in range(3):
                    square += (nodes_points[moves[i, c], a] - nodes_points[moves[i, 0], a]) ** 2
                spacing += np.sqrt(square)
                count += 1
        for c in range(width):
            walls[i, c] = barrier[i, c] * spacing / max(count, 1)
    return walls


@inner
def _preferred_moves(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    barrier_force: FloatArray,
    k: FloatArray,
    sigma_f: float,
    points: FloatArray,
    vertices: IntArray,
) -> IntArray:
    """Return each contact's moves along its projected force, best aligned first, -1 after the last."""
    n_f, width = moves.shape
    terms = np.zeros((4, n_f, 3))
    field(points, centroid, k, terms)
    order = np.full((n_f, width), -1, dtype=np.int64)
    cosines = np.empty(width)
    force = np.empty(3)
    for i in range(n_f):
        normal_part = 0.0
        for a in range(3):
            force[a] = terms[0, i, a] + terms[1, i, a] + terms[2, i, a] + terms[3, i, a] + barrier_force[i, a]
            normal_part += force[a] * nodes_normals[vertices[i], a]
        size = 0.0
        for a in range(3):
            force[a] -= normal_part * nodes_normals[vertices[i], a]
            size += force[a] ** 2
        size = np.sqrt(size)
        if size <= sigma_f:
            continue
        for c in range(width):
            cosines[c] = 0.0
            if c == 0 or moves[i, c] < 0:
                continue
            along, length, rise = 0.0, 0.0, 0.0
            for a in range(3):
                step = nodes_points[moves[i, c], a] - points[i, a]
                along += step * force[a]
                length += step * step
                rise += step * nodes_normals[vertices[i], a]
            length -= rise * rise
            if length > 0.0:
                cosines[c] = along / (np.sqrt(length) * size)
        for rank in range(width):
            best = 0
            for c in range(1, width):
                if cosines[c] > cosines[best]:
                    best = c
            if cosines[best] <= 1e-9:
                break
            order[i, rank] = best
            cosines[best] = 0.0
    return order


@inner
def _try_together(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    order: IntArray,
    below: float,
    points: FloatArray,
    vertices: IntArray,
) -> bool:
    """Move every contact to the neighbour closest to its force, if that lowers the potential."""
    n_f = len(vertices)
    chosen = vertices.copy()
    moved = points.copy()
    value, any_moves = 0.0, False
    for i in range(n_f):
        column = 0
        if order[i, 0] > 0:
            column, any_moves = order[i, 0], True
        chosen[i] = moves[i, column]
        for a in range(3):
            moved[i, a] = nodes_points[chosen[i], a]
        value += walls[i, column]
    if not any_moves or not distinct(chosen):
        return False
    if value + potential(moved, centroid, k, radius) >= below:
        return False
    for i in range(n_f):
        vertices[i] = chosen[i]
    return True


@inner
def _try_alone(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    order: IntArray,
    below: float,
    points: FloatArray,
    vertices: IntArray,
) -> bool:
    """Move the one contact whose first useful move along its force lowers the potential most."""
    n_f, width = moves.shape
    standing = 0.0
    for i in range(n_f):
        standing += walls[i, 0]
    best, best_finger, best_node = below, -1, -1
    chosen = vertices.copy()
    moved = points.copy()
    for i in range(n_f):
        for rank in range(width):
            column = order[i, rank]
            if column < 0:
                break
            chosen[i] = moves[i, column]
            for a in range(3):
                moved[i, a] = nodes_points[chosen[i], a]
            value = standing - walls[i, 0] + walls[i, column] + potential(moved, centroid, k, radius)
            if value < below and distinct(chosen):
                if value < best:
                    best, best_finger, best_node = value, i, chosen[i]
                break
        chosen[i] = vertices[i]
        for a in range(3):
            moved[i, a] = points[i, a]
    if best_finger < 0:
        return False
    vertices[best_finger] = best_node
    return True
