"""Compiled climbs of many grasps along the force field, proposal by proposal."""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.balance import imbalance, propose_balance
from graspbench.planning.field import mean_radius, potential
from graspbench.planning.field_moves import propose_moves


@compiled
def climb_field(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    contour_start: IntArray,
    contour_nodes: IntArray,
    allowed: BoolArray,
    k: FloatArray,
    sigma_f: float,
    thorough: bool,
    balance: FloatArray,
    starts: IntArray,
    paths: IntArray,
    first: IntArray,
) -> None:
    """Follow proposals from every start until there is none, writing every configuration.

    A proposal depends on the configuration alone, so where ways meet they are one from there on.

    Args:
        nodes_points: Surface nodes, shape (n_s, 3).
        nodes_normals: Their outward unit normals, shape (n_s, 3).
        centroid: Centroid, shape (3,).
        contour_start: Row in ``contour_nodes`` of each node's contour, shape (n_s + 1,).
        contour_nodes: The contours.
        allowed: Nodes that contacts may move to, shape (n_s,).
        k: Coefficients of the potential.
        sigma_f: Force below which a contact stays, N.
        thorough: Whether several contacts may move together down the potential.
        balance: Coefficients of the imbalance, which is then what is lowered; empty: the potential is.
        starts: Where to start, shape (m, n_f).
        paths: Output, ways one after the other, shape (m * (max_moves + 1), n_f).
        first: Output, row of each way's first configuration, and after the last one, shape (m + 1,).
    """
    m, n_f = starts.shape
    longest = paths.shape[0] // max(m, 1)
    radius = mean_radius(nodes_points, centroid)
    no_force, vertices = np.zeros((n_f, 3)), np.empty(n_f, dtype=np.int64)
    widest = 1
    for node in range(len(contour_start) - 1):
        widest = max(widest, 1 + contour_start[node + 1] - contour_start[node])
    # Contiguous, as those of a single proposal are: so what proposes is compiled once.
    moves_room, walls_room = np.empty(n_f * widest, dtype=np.int64), np.zeros(n_f * widest)
    row = 0
    first[0] = 0
    for grasp in range(m):
        for i in range(n_f):
            vertices[i] = paths[row, i] = starts[grasp, i]
        row += 1
        for _ in range(longest - 1):
            width = 1
            for i in range(n_f):
                width = max(width, 1 + contour_start[vertices[i] + 1] - contour_start[vertices[i]])
            moves = moves_room[: n_f * width].reshape(n_f, width)
            walls = walls_room[: n_f * width].reshape(n_f, width)
            for i in range(n_f):
                start, end = contour_start[vertices[i]], contour_start[vertices[i] + 1]
                moves[i, 0] = vertices[i]
                for c in range(1, width):
                    moves[i, c] = -1
                for c in range(end - start):
                    if allowed[contour_nodes[start + c]]:
                        moves[i, 1 + c] = contour_nodes[start + c]
            if len(balance) > 0:
                moved = propose_balance(
                    nodes_points, nodes_normals, centroid, moves, walls, balance, vertices
                )
            else:
                moved = propose_moves(
                    nodes_points,
                    nodes_normals,
                    centroid,
                    moves,
                    walls,
                    no_force,
                    k,
                    sigma_f,
                    radius,
                    thorough,
                    vertices,
                )
            if not moved:
                break
            for i in range(n_f):
                paths[row, i] = vertices[i]
            row += 1
            if _go_on_as_before(paths, first, grasp, row):
                row = first[grasp + 1]
                break
        first[grasp + 1] = row


@inner
def _go_on_as_before(paths: IntArray, first: IntArray, grasp: int, row: int) -> bool:
    """Where an earlier climb has been at the last configuration, write the rest of its way, and end there."""
    n_f, longest = paths.shape[1], paths.shape[0] // (len(first) - 1)
    for earlier in range(grasp):
        if first[earlier + 1] - first[earlier] == longest:
            continue  # it was stopped, maybe before its end
        for met in range(first[earlier], first[earlier + 1]):
            same = True
            for i in range(n_f):
                same &= paths[met, i] == paths[row - 1, i]
            if not same:
                continue
            left = min(first[earlier + 1] - met - 1, longest - (row - first[grasp]))
            for k in range(left):
                for i in range(n_f):
                    paths[row + k, i] = paths[met + 1 + k, i]
            first[grasp + 1] = row + left
            return True
    return False


@compiled
def field_values(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    k: FloatArray,
    balance: FloatArray,
    grasps: IntArray,
    values: FloatArray,
) -> None:
    """Write the imbalance of many grasps, N, or without its coefficients the potential, J.

    Args:
        nodes_points: Surface nodes, shape (n_s, 3).
        nodes_normals: Their outward unit normals, shape (n_s, 3).
        centroid: Centroid, shape (3,).
        k: Coefficients of the potential.
        balance: Coefficients of the imbalance; empty: the potential is wanted.
        grasps: Vertices, shape (m, n_f).
        values: Output, shape (m,).
    """
    n_f = grasps.shape[1]
    radius = mean_radius(nodes_points, centroid)
    points, normals = np.empty((n_f, 3)), np.empty((n_f, 3))
    for grasp in range(len(grasps)):
        for i in range(n_f):
            for a in range(3):
                points[i, a] = nodes_points[grasps[grasp, i], a]
                normals[i, a] = nodes_normals[grasps[grasp, i], a]
        if len(balance) > 0:
            values[grasp] = imbalance(points, normals, centroid, balance)
        else:
            values[grasp] = potential(points, centroid, k, radius)
