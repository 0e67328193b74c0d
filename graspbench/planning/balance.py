"""How far a grasp is from the equilibrium of the force field, and moves towards it (thesis 3.4.2).

The thesis calls a grasp optimal when no projected force is left at any contact. A sum of forces can vanish
because one error hides another, so every term is projected by itself. What is left is the imbalance, in N,

    U = max_i k_a |u_i'| + mean_i ((k_pi d_i + k_cm h) |n'| / l + k_e |e_i| |t_i'| / a)
        + k_n |sum_i v_i| - k_r sqrt(A) / r

with d_i, h, e_i and r as in `graspbench.planning.indices.force_field`, n the grip plane's normal, u_i
outwards from c^PI to the contact, t_i = n x u_i, x' the part of the unit vector x that is tangential to the
surface, v_i the surface normals, and A the area of the grasp polygon, which the thesis wants large. Without
the last term U is zero just where the contacts lie at equal angles in one plane through the centroid, with
surface normals that all point away from c^PI. The term of k_n says the last thing of all normals together:
equal forces along them cancel, as they have to where there is no friction. The push outwards is judged by
the contact where most of it is left, as the thesis' threshold does.
"""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.field_subsets import distinct
from graspbench.planning.grip_plane import plane_numbers

_TIE = 1e-12
"""Moves that are as good as the best but for rounding do not replace it, N."""


@compiled
def imbalance(points: FloatArray, normals: FloatArray, centroid: FloatArray, k: FloatArray) -> float:
    """Return the imbalance of a grasp, N.

    Args:
        points: Contacts in cyclic order, shape (n_f, 3), m.
        normals: Outward unit surface normals there, shape (n_f, 3).
        centroid: Centroid of the surface, shape (3,).
        k: k_pi / l, k_cm / l, k_e / a, k_a, k_r / r and k_n; SI units, shape (6,).
    """
    n_f = points.shape[0]
    x, y, z, mx, my, mz = plane_numbers(points, centroid)
    offset = (centroid[0] - mx) * x + (centroid[1] - my) * y + (centroid[2] - mz) * z
    errors, worst, area = 0.0, 0.0, 0.0
    sum_u, sum_v, sum_w = 0.0, 0.0, 0.0
    for i in range(n_f):
        j = (i + 1) % n_f
        ax, ay, az = points[i, 0] - centroid[0], points[i, 1] - centroid[1], points[i, 2] - centroid[2]
        bx, by, bz = points[j, 0] - centroid[0], points[j, 1] - centroid[1], points[j, 2] - centroid[2]
        rise = ax * x + ay * y + az * z
        ax, ay, az = ax - rise * x, ay - rise * y, az - rise * z
        sine = x * (ay * bz - az * by) + y * (az * bx - ax * bz) + z * (ax * by - ay * bx)
        area += 0.5 * sine
        angle = np.arctan2(sine, ax * bx + ay * by + az * bz)
        error = abs((angle if angle >= 0.0 else angle + 2.0 * np.pi) - 2.0 * np.pi / n_f)
        size = np.sqrt(ax * ax + ay * ay + az * az)
        u, v, w = normals[i, 0], normals[i, 1], normals[i, 2]
        sum_u, sum_v, sum_w = sum_u + u, sum_v + v, sum_w + w
        across = u * x + v * y + w * z
        errors += (k[0] * abs(rise + offset) + k[1] * abs(offset)) * np.sqrt(max(0.0, 1.0 - across * across))
        if size == 0.0:
            errors += k[2] * error
            worst = max(worst, k[3])
            continue
        outwards = (u * ax + v * ay + w * az) / size
        onwards = (u * (y * az - z * ay) + v * (z * ax - x * az) + w * (x * ay - y * ax)) / size
        errors += k[2] * error * np.sqrt(max(0.0, 1.0 - onwards * onwards))
        # Where the surface faces the centroid, no push outwards is ever balanced.
        left = np.sqrt(max(0.0, 1.0 - outwards * outwards))
        worst = max(worst, k[3] * (left if outwards >= 0.0 else 2.0 - left))
    uncancelled = np.sqrt(sum_u * sum_u + sum_v * sum_v + sum_w * sum_w)
    return float(worst + errors / n_f + k[5] * uncancelled - k[4] * np.sqrt(max(0.0, area)))


@compiled
def propose_balance(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    barrier: FloatArray,
    k: FloatArray,
    vertices: IntArray,
) -> bool:
    """Write the move of one contact, or if none helps of two, that lowers the imbalance most.

    Args:
        nodes_points: Surface nodes, shape (n_s, 3).
        nodes_normals: Their outward unit normals, shape (n_s, 3).
        centroid: Centroid, shape (3,).
        moves: Where each contact may go, -1 for nowhere; column 0 is to stay, shape (n_f, width).
        barrier: What the hand adds to the imbalance there, N, shape (n_f, width).
        k: See `imbalance`.
        vertices: The contacts; overwritten, shape (n_f,).

    Returns:
        Whether any move lowers it.
    """
    n_f, width = moves.shape
    points, normals = np.empty((n_f, 3)), np.empty((n_f, 3))
    standing = 0.0
    for i in range(n_f):
        _put(nodes_points, nodes_normals, vertices[i], points, normals, i)
        standing += barrier[i, 0]
    here = standing + imbalance(points, normals, centroid, k)
    best = here - 1e-9 * (1.0 + abs(here))
    found, chosen, improved = vertices.copy(), vertices.copy(), False
    for i in range(n_f):
        for c in range(1, width):
            if moves[i, c] < 0:
                continue
            chosen[i] = moves[i, c]
            _put(nodes_points, nodes_normals, chosen[i], points, normals, i)
            value = standing - barrier[i, 0] + barrier[i, c] + imbalance(points, normals, centroid, k)
            if value < best - _TIE and distinct(chosen):
                best, improved = value, True
                found[:] = chosen
        chosen[i] = vertices[i]
        _put(nodes_points, nodes_normals, chosen[i], points, normals, i)
    if not improved:
        for i in range(n_f):
            for j in range(i):
                for c in range(1, width):
                    if moves[i, c] < 0:
                        continue
                    chosen[i] = moves[i, c]
                    _put(nodes_points, nodes_normals, chosen[i], points, normals, i)
                    for d in range(1, width):
                        if moves[j, d] < 0:
                            continue
                        chosen[j] = moves[j, d]
                        _put(nodes_points, nodes_normals, chosen[j], points, normals, j)
                        walls = barrier[i, c] + barrier[j, d] - barrier[i, 0] - barrier[j, 0]
                        value = standing + walls + imbalance(points, normals, centroid, k)
                        if value < best - _TIE and distinct(chosen):
                            best, improved = value, True
                            found[:] = chosen
                chosen[j] = vertices[j]
                _put(nodes_points, nodes_normals, chosen[j], points, normals, j)
            chosen[i] = vertices[i]
            _put(nodes_points, nodes_normals, chosen[i], points, normals, i)
    if improved:
        vertices[:] = found
    return improved


@inner
def _put(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    node: int,
    points: FloatArray,
    normals: FloatArray,
    contact: int,
) -> None:
    for a in range(3):
        points[contact, a] = nodes_points[node, a]
        normals[contact, a] = nodes_normals[node, a]
