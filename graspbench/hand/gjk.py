"""Compiled distance between rounded boxes, segments and cylinders (Gilbert, Johnson and Keerthi 1988).

A shape is a core (a point or segment along its z axis, a box, or a solid cylinder along its z axis)
swept by a ball.
"""

import math

import numpy as np
from numba import njit

from graspbench.arrays import FloatArray

SEGMENT, BOX, CYLINDER = 0, 1, 2
ACCURACY_M = 1e-7


@njit(cache=True, nogil=True)
def support(
    kind: int, rotation: FloatArray, centre: FloatArray, half: FloatArray, x: float, y: float, z: float,
    out: FloatArray,
) -> None:
    """Find the core's point that is farthest along the direction (x, y, z).

    Args:
        kind: SEGMENT, BOX or CYLINDER.
        rotation: Orientation of the shape, shape (3, 3).
        centre: Centre of the shape, shape (3,).
        half: Half extents along its axes, shape (3,), m.
        x: Direction, of any length.
        y: Direction.
        z: Direction.
        out: Output, shape (3,).
    """
    c = rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z
    c = half[2] if c >= 0.0 else -half[2]
    if kind == SEGMENT:
        for row in range(3):
            out[row] = centre[row] + rotation[row, 2] * c
        return
    a = rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z
    b = rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z
    if kind == BOX:
        a = half[0] if a >= 0.0 else -half[0]
        b = half[1] if b >= 0.0 else -half[1]
    else:
        length = math.sqrt(a * a + b * b)
        scale = half[0] / length if length > 1e-12 else 0.0
        a, b = a * scale, b * scale
    for row in range(3):
        out[row] = centre[row] + rotation[row, 0] * a + rotation[row, 1] * b + rotation[row, 2] * c


@njit(cache=True, nogil=True)
def segment_distance(
    rotation_a: FloatArray, centre_a: FloatArray, half_a: float,
    rotation_b: FloatArray, centre_b: FloatArray, half_b: float,
    point_a: FloatArray, point_b: FloatArray,
) -> float:
    """Distance between two segments given by centre, direction (column 2) and half length, in closed form.

    Source: Ericson, Real-Time Collision Detection (2005), 5.1.9. ``point_a`` and ``point_b`` receive the
    nearest points, shape (3,).
    """
    along = ra = rb = 0.0
    for row in range(3):
        gap = centre_b[row] - centre_a[row]
        along += rotation_a[row, 2] * rotation_b[row, 2]
        ra += rotation_a[row, 2] * gap
        rb += rotation_b[row, 2] * gap
    spread = 1.0 - along * along
    s = (ra - along * rb) / spread if spread > 1e-12 else 0.0
    s = min(half_a, max(-half_a, s))
    t = min(half_b, max(-half_b, along * s - rb))
    s = min(half_a, max(-half_a, along * t + ra))
    square = 0.0
    for row in range(3):
        point_a[row] = centre_a[row] + s * rotation_a[row, 2]
        point_b[row] = centre_b[row] + t * rotation_b[row, 2]
        square += (point_a[row] - point_b[row]) ** 2
    return math.sqrt(square)


@njit(cache=True, nogil=True)
def core_distance(
    kind_a: int, rotation_a: FloatArray, centre_a: FloatArray, half_a: FloatArray,
    kind_b: int, rotation_b: FloatArray, centre_b: FloatArray, half_b: FloatArray,
    point_a: FloatArray, point_b: FloatArray,
) -> float:
    """Distance between two cores; 0 when they overlap.

    ``point_a`` and ``point_b`` receive the nearest points, shape (3,).
    """
    if kind_a == SEGMENT and kind_b == SEGMENT:
        return segment_distance(
            rotation_a, centre_a, half_a[2], rotation_b, centre_b, half_b[2], point_a, point_b
        )
    simplex, on_a, on_b, weight = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3)), np.empty(4)
    x, y, z = centre_a[0] - centre_b[0], centre_a[1] - centre_b[1], centre_a[2] - centre_b[2]
    if x * x + y * y + z * z < 1e-16:
        x = 1e-3
    n = 0
    for _ in range(64):
        square = x * x + y * y + z * z
        support(kind_a, rotation_a, centre_a, half_a, -x, -y, -z, on_a[n])
        support(kind_b, rotation_b, centre_b, half_b, x, y, z, on_b[n])
        for row in range(3):
            simplex[n, row] = on_a[n, row] - on_b[n, row]
        along = x * simplex[n, 0] + y * simplex[n, 1] + z * simplex[n, 2]
        # The support plane bounds the distance from below: stop when the bounds meet.
        if n > 0 and square - along <= ACCURACY_M * math.sqrt(square):
            break
        n = _reduce(simplex, on_a, on_b, weight, n + 1)
        if n == 4:
            _combine(on_a, weight, 4, point_a)
            _combine(on_b, weight, 4, point_b)
            return 0.0
        x = y = z = 0.0
        for i in range(n):
            x += weight[i] * simplex[i, 0]
            y += weight[i] * simplex[i, 1]
            z += weight[i] * simplex[i, 2]
        if x * x + y * y + z * z < 1e-16:
            break
    _combine(on_a, weight, n, point_a)
    _combine(on_b, weight, n, point_b)
    return math.sqrt(x * x + y * y + z * z)


@njit(cache=True, nogil=True)
def _combine(points: FloatArray, weight: FloatArray, n: int, out: FloatArray) -> None:
    for row in range(3):
        out[row] = 0.0
        for i in range(n):
            out[row] += weight[i] * points[i, row]


@njit(cache=True, nogil=True)
def _dot(a: FloatArray, b: FloatArray) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True)
def _closest_on_triangle(a: FloatArray, b: FloatArray, c: FloatArray, weight: FloatArray) -> float:
    """Barycentric weights of the triangle's point nearest to the origin, and its squared distance.

    Source: Ericson, Real-Time Collision Detection (2005), 5.1.5.
    """
    ab, ac = b - a, c - a
    d1, d2 = -_dot(ab, a), -_dot(ac, a)
    d3, d4 = -_dot(ab, b), -_dot(ac, b)
    d5, d6 = -_dot(ab, c), -_dot(ac, c)
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    v = w = 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        v = w = 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        total = va + vb + vc
        v, w = vb / total, vc / total
    weight[0], weight[1], weight[2] = 1.0 - v - w, v, w
    square = 0.0
    for row in range(3):
        square += (weight[0] * a[row] + v * b[row] + w * c[row]) ** 2
    return square


@njit(cache=True, nogil=True)
def _reduce(simplex: FloatArray, on_a: FloatArray, on_b: FloatArray, weight: FloatArray, n: int) -> int:
    """Keep the simplex's vertices that carry its point nearest to the origin; set their weights."""
    full = np.zeros(4)
    if n == 1:
        full[0] = 1.0
    elif n == 2:
        edge = simplex[1] - simplex[0]
        length = _dot(edge, edge)
        t = -_dot(simplex[0], edge) / length if length > 0.0 else 0.0
        full[1] = min(1.0, max(0.0, t))
        full[0] = 1.0 - full[1]
    elif n == 3:
        _closest_on_triangle(simplex[0], simplex[1], simplex[2], full)
    else:
        _closest_on_tetrahedron(simplex, full)
    kept = 0
    for i in range(n):
        if full[i] > 0.0:
            for row in range(3):
                simplex[kept, row] = simplex[i, row]
                on_a[kept, row] = on_a[i, row]
                on_b[kept, row] = on_b[i, row]
            weight[kept] = full[i]
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _closest_on_tetrahedron(simplex: FloatArray, full: FloatArray) -> None:
    """Weights of the tetrahedron's point nearest to the origin; all positive when it lies inside."""
    best, outside = np.inf, False
    trial = np.empty(3)
    for face in range(4):
        i, j, k = (face + 1) % 4, (face + 2) % 4, (face + 3) % 4
        a, b, c = simplex[i], simplex[j], simplex[k]
        normal = np.empty(3)
        u, v = b - a, c - a
        normal[0] = u[1] * v[2] - u[2] * v[1]
        normal[1] = u[2] * v[0] - u[0] * v[2]
        normal[2] = u[0] * v[1] - u[1] * v[0]
        apex = _dot(normal, simplex[face]) - _dot(normal, a)
        origin = -_dot(normal, a)
        flat = apex * apex <= 1e-24 * _dot(normal, normal)
        if flat or origin * apex <= 0.0:
            outside = True
            square = _closest_on_triangle(a, b, c, trial)
            if square < best:
                best = square
                full[:] = 0.0
                full[i], full[j], full[k] = trial[0], trial[1], trial[2]
    if not outside:
        # Any interior weights will do: the cores overlap.
        full[:] = 0.25
