"""All triples of nodes, for three frictionless contacts whose planar forces alone count.

With the inward normals n_i, the unit normal m of the plane of the contacts, s_i = n_i . m and
c_ij = (n_i x n_j) . m,
the planar forces f_i = n_i - s_i m have the cross products c_ij, so that

* the grasp is force closure just when the c_ij of all three pairs, in cyclic order, have one sign,
* det(G G^T) = sum c_ij^2 and tr(G G^T) = 3 - sum s_i^2, which give Q1 and Q2,
* Q3 (L1) = min |c_ij| / |f_i - f_j|, the distance of the origin from the sides of the triangle of forces.

That is so cheap that nothing has to be bounded cluster by cluster, where bounds come too close to the
largest value there can be. Pairs of normals are left out first (`pair_cosines`): a grasp that is better than
a known one has any two of them at nearly 120 degrees, the more nearly the better that one is.
"""

import math

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.search.bounds import Q2, Q3

ROUNDING = 1e-7
"""Values are taken to be exact within this share."""

_FLAT = 1e-5
"""Sine below which three contacts count as on a line: their plane then depends on rounding."""


def pair_cosines(measure: int, lower: float) -> tuple[float, float]:
    """Return the least and the largest cosine of two normals of a grasp that is better than a known one.

    Let G G^T have the eigenvalues l1 <= l2. With S = sum s_i^2 its trace is 3 - S, so l2 - l1 + S is at most
    3 - 2 l1. The forces' products f_i . f_j are -l1 w_i w_j + (l2 - l1) v_i v_j for unit vectors w and v
    across each other, w positive where the grasp is force closure. Since |f_i| is at most one, w_i^2 is at
    least a = 1 - 1 / l1. So n_i . n_j = f_i . f_j + s_i s_j is between -3/4 (1 - a) and -l1 a, but for half
    of 3 - 2 l1. Q1 and Q2 each give a least l1.

    For Q3 no side of the triangle of forces is nearer to the origin than r, and no corner farther than one:
    no two forces enclose more than 2 acos(r), hence none less than 2 pi - 4 acos(r).

    Args:
        measure: Q1, Q2 or Q3.
        lower: The known value.
    """
    lower = lower * (1.0 - ROUNDING)
    if lower <= 0.0:
        return -1.0, 1.0
    if measure == Q3:
        return _pair_cosines_of_ball(min(lower, 0.5))
    least = lower * lower
    if measure == Q2:
        least = 0.5 * (3.0 - math.sqrt(max(9.0 - 4.0 * lower * lower, 0.0)))
    least = min(least, 1.5)
    share, slack = max(0.0, 1.0 - 1.0 / least), 0.5 * (3.0 - 2.0 * least)
    return max(-1.0, -0.75 * (1.0 - share) - slack), min(1.0, slack - least * share)


def _pair_cosines_of_ball(radius: float) -> tuple[float, float]:
    widest = 2.0 * math.acos(radius)
    narrowest = max(2.0 * math.pi - 2.0 * widest, 0.0)
    # From a corner at distance one, a side that touches the ball meets the next force where it ends.
    shortest = radius / math.cos(max(narrowest - 0.5 * widest, 0.0))
    sides = [math.cos(narrowest), math.cos(widest)]
    products = [length * cosine for length in (shortest * shortest, 1.0) for cosine in sides]
    slack = 1.0 - shortest * shortest
    return max(-1.0, min(products) - slack), min(1.0, max(products) + slack)


@compiled
def list_triples(
    points: FloatArray,
    normals: FloatArray,
    compatible: BoolArray,
    measure: int,
    centroid: FloatArray,
    centre_limit: float,
    floor: float,
    ceiling: float,
    first: int,
    end: int,
    triples: IntArray,
    values: FloatArray,
) -> int:
    """List the force closure triples whose first node is in a range and whose values are in another.

    Args:
        points: Shape (n, 3).
        normals: Inward unit normals, shape (n, 3).
        compatible: Which pairs may be in one grasp, shape (n, n).
        measure: Q1, Q2 or Q3.
        centroid: Shape (3,).
        centre_limit: Largest distance of the contacts' mean from the centroid.
        floor: Values at or below it are left out.
        ceiling: Values above it are left out.
        first: First node of the range.
        end: Node after its last one.
        triples: Written: as many as there is room for, shape (m, 3).
        values: Written: upper bounds of their values, equal to them but for rounding, shape (m,).

    Returns:
        How many there are; more than m if there was no room for all.
    """
    later = np.empty(points.shape[0], np.int64)
    found = 0
    within = 9.0 * centre_limit * centre_limit
    for i in range(first, end):
        count = 0
        for j in range(i + 1, points.shape[0]):
            if compatible[i, j]:
                later[count] = j
                count += 1
        for a in range(count):
            j = later[a]
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            u = normals[i, 1] * normals[j, 2] - normals[i, 2] * normals[j, 1]
            v = normals[i, 2] * normals[j, 0] - normals[i, 0] * normals[j, 2]
            w = normals[i, 0] * normals[j, 1] - normals[i, 1] * normals[j, 0]
            gap = x * x + y * y + z * z
            cx = points[i, 0] + points[j, 0] - 3.0 * centroid[0]
            cy = points[i, 1] + points[j, 1] - 3.0 * centroid[1]
            cz = points[i, 2] + points[j, 2] - 3.0 * centroid[2]
            for b in range(a + 1, count):
                k = later[b]
                if not compatible[j, k]:
                    continue
                dx, dy, dz = cx + points[k, 0], cy + points[k, 1], cz + points[k, 2]
                if dx * dx + dy * dy + dz * dz > within:
                    continue
                dx, dy = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
                dz = points[k, 2] - points[i, 2]
                p, q, r = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx
                size = p * p + q * q + r * r
                if size <= _FLAT * _FLAT * gap * (dx * dx + dy * dy + dz * dz):
                    value = _on_a_line(normals, i, j, k, measure)
                else:
                    along = u * p + v * q + w * r
                    value = _value(normals, i, j, k, p, q, r, size, along, measure)
                value *= 1.0 + ROUNDING
                if value > floor and value <= ceiling:
                    if found < triples.shape[0]:
                        triples[found, 0], triples[found, 1], triples[found, 2] = i, j, k
                        values[found] = value
                    found += 1
    return found


@inner
def _value(
    normals: FloatArray,
    i: int,
    j: int,
    k: int,
    p: float,
    q: float,
    r: float,
    size: float,
    along: float,
    measure: int,
) -> float:
    """Return the measure of a triple; zero where it is not force closure.

    Args:
        normals: Inward unit normals, shape (n, 3).
        i: First node.
        j: Second node.
        k: Third node.
        p: The plane's normal, not a unit one.
        q: Its second component.
        r: Its third component.
        size: Its square.
        along: Its product with n_i x n_j.
        measure: Q1, Q2 or Q3.
    """
    ix, iy, iz = normals[i, 0], normals[i, 1], normals[i, 2]
    jx, jy, jz = normals[j, 0], normals[j, 1], normals[j, 2]
    kx, ky, kz = normals[k, 0], normals[k, 1], normals[k, 2]
    second = (jy * kz - jz * ky) * p + (jz * kx - jx * kz) * q + (jx * ky - jy * kx) * r
    if along * second <= 0.0:
        return 0.0
    third = (ky * iz - kz * iy) * p + (kz * ix - kx * iz) * q + (kx * iy - ky * ix) * r
    if along * third <= 0.0:
        return 0.0
    si, sj, sk = ix * p + iy * q + iz * r, jx * p + jy * q + jz * r, kx * p + ky * q + kz * r
    if measure == Q3:
        least = along * along / max(_apart(normals, i, j) * size - (si - sj) ** 2, 1e-300)
        least = min(least, second * second / max(_apart(normals, j, k) * size - (sj - sk) ** 2, 1e-300))
        least = min(least, third * third / max(_apart(normals, k, i) * size - (sk - si) ** 2, 1e-300))
        return math.sqrt(least)
    determinant = (along * along + second * second + third * third) / size
    if measure == Q2:
        return math.sqrt(determinant)
    trace = 3.0 - (si * si + sj * sj + sk * sk) / size
    # The smaller root, without the difference of nearly equal numbers.
    return math.sqrt(2.0 * determinant / (trace + math.sqrt(max(trace * trace - 4.0 * determinant, 0.0))))


@inner
def _apart(normals: FloatArray, i: int, j: int) -> float:
    """Return the square of the distance of two normals."""
    x, y, z = normals[i, 0] - normals[j, 0], normals[i, 1] - normals[j, 1], normals[i, 2] - normals[j, 2]
    return float(x * x + y * y + z * z)


@inner
def _on_a_line(normals: FloatArray, i: int, j: int, k: int, measure: int) -> float:
    """Return an upper bound of the measure whatever the plane: that of the forces in space.

    A projection to a plane interlaces the eigenvalues; and a ball of radius r needs a force of r to either
    side of every line through the origin, so that Q1^2 is at least 2 r^2.
    """
    gram = np.zeros((3, 3))
    for node in (i, j, k):
        for a in range(3):
            for b in range(3):
                gram[a, b] += normals[node, a] * normals[node, b]
    values = np.linalg.eigvalsh(gram)
    if measure == Q2:
        return math.sqrt(max(values[1] * values[2], 0.0))
    return math.sqrt(max(values[1], 0.0) * (0.5 if measure == Q3 else 1.0))
