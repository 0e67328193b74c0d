"""The charts' formulas, compiled: point, first and second derivatives, Gauss frame and matrix C."""

import math
from enum import IntEnum

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled, inner

HEADER = 12
"""Numbers before a chart's own ones: its rotation and origin in the object frame."""


class ChartKind(IntEnum):
    """Which formula a chart has."""

    PLANE = 0
    SPHERE = 1
    ELLIPSOID = 2
    CYLINDER = 3
    REVOLUTION = 4
    PATCH = 5


@compiled
def chart_derivatives(kind: int, p: FloatArray, u: float, v: float, out: FloatArray) -> None:
    """Write c, c_u, c_v, c_uu, c_uv, c_vv in the object frame into ``out``, shape (6, 3).

    Args:
        kind: A `ChartKind`.
        p: The chart's numbers (`charts.Chart.parameters`).
        u: First coordinate.
        v: Second coordinate.
        out: The result.
    """
    d = np.zeros((6, 3))
    if kind == ChartKind.PLANE:
        d[0, 0], d[0, 1] = u, v
        d[1, 0] = 1.0
        d[2, 1] = 1.0
    elif kind == ChartKind.ELLIPSOID:
        _ellipsoid(p[HEADER], p[HEADER + 1], p[HEADER + 2], u, v, d)
    elif kind == ChartKind.PATCH:
        _patch(p[HEADER:], u, v, d)
    else:
        _revolution(kind, p[HEADER:], u, v, d)
    for k in range(6):
        for i in range(3):
            out[k, i] = p[3 * i] * d[k, 0] + p[3 * i + 1] * d[k, 1] + p[3 * i + 2] * d[k, 2]
    for i in range(3):
        out[0, i] += p[9 + i]


@inner
def _revolution(kind: int, p: FloatArray, u: float, v: float, d: FloatArray) -> None:
    """Spheres, cylinders and splined profiles: c = (rho(v) cos u, rho(v) sin u, zeta(v))."""
    rho, rho1, rho2 = p[0], 0.0, 0.0
    zeta, zeta1, zeta2 = v, 1.0, 0.0
    if kind == ChartKind.SPHERE:
        rho, rho1, rho2 = p[0] * math.cos(v), -p[0] * math.sin(v), -p[0] * math.cos(v)
        zeta, zeta1, zeta2 = p[0] * math.sin(v), p[0] * math.cos(v), -p[0] * math.sin(v)
    elif kind == ChartKind.REVOLUTION:
        pieces = int(p[0])
        piece = min(max(int(v * pieces), 0), pieces - 1)
        t = v - piece / pieces
        a = 1 + 8 * piece  # four rows (cubic ... constant) of (rho, zeta)
        rho = ((p[a] * t + p[a + 2]) * t + p[a + 4]) * t + p[a + 6]
        rho1 = (3.0 * p[a] * t + 2.0 * p[a + 2]) * t + p[a + 4]
        rho2 = 6.0 * p[a] * t + 2.0 * p[a + 2]
        zeta = ((p[a + 1] * t + p[a + 3]) * t + p[a + 5]) * t + p[a + 7]
        zeta1 = (3.0 * p[a + 1] * t + 2.0 * p[a + 3]) * t + p[a + 5]
        zeta2 = 6.0 * p[a + 1] * t + 2.0 * p[a + 3]
    c, s = math.cos(u), math.sin(u)
    d[0, 0], d[0, 1], d[0, 2] = rho * c, rho * s, zeta
    d[1, 0], d[1, 1] = -rho * s, rho * c
    d[2, 0], d[2, 1], d[2, 2] = rho1 * c, rho1 * s, zeta1
    d[3, 0], d[3, 1] = -rho * c, -rho * s
    d[4, 0], d[4, 1] = -rho1 * s, rho1 * c
    d[5, 0], d[5, 1], d[5, 2] = rho2 * c, rho2 * s, zeta2


@inner
def _ellipsoid(a: float, b: float, c: float, u: float, v: float, d: FloatArray) -> None:
    """Jacobi's ellipsoidal coordinates for a >= b >= c, a > c; the lines of curvature."""
    cu, su, cv, sv = math.cos(u), math.sin(u), math.cos(v), math.sin(v)
    span = a * a - c * c
    f = math.sqrt(max((a * a - b * b * sv * sv - c * c * cv * cv) / span, 1e-300))
    g = math.sqrt(max((a * a * su * su + b * b * cu * cu - c * c) / span, 1e-300))
    f1 = (c * c - b * b) / span * sv * cv / f
    g1 = (a * a - b * b) / span * su * cu / g
    f2 = ((c * c - b * b) / span * (cv * cv - sv * sv) - f1 * f1) / f
    g2 = ((a * a - b * b) / span * (cu * cu - su * su) - g1 * g1) / g
    d[0, 0], d[0, 1], d[0, 2] = a * cu * f, b * cv * su, c * sv * g
    d[1, 0], d[1, 1], d[1, 2] = -a * su * f, b * cv * cu, c * sv * g1
    d[2, 0], d[2, 1], d[2, 2] = a * cu * f1, -b * sv * su, c * cv * g
    d[3, 0], d[3, 1], d[3, 2] = -a * cu * f, -b * cv * su, c * sv * g2
    d[4, 0], d[4, 1], d[4, 2] = -a * su * f1, -b * sv * cu, c * cv * g1
    d[5, 0], d[5, 1], d[5, 2] = a * cu * f2, -b * cv * su, -c * sv * g


@inner
def _patch(k: FloatArray, u: float, v: float, d: FloatArray) -> None:
    """Cubic height field: c = (u, v, f)."""
    d[0, 0], d[0, 1] = u, v
    d[0, 2] = (
        k[0] * u
        + k[1] * v
        + k[2] * u * u
        + k[3] * u * v
        + k[4] * v * v
        + k[5] * u * u * u
        + k[6] * u * u * v
        + k[7] * u * v * v
        + k[8] * v * v * v
    )
    d[1, 0] = 1.0
    d[1, 2] = k[0] + 2.0 * k[2] * u + k[3] * v + 3.0 * k[5] * u * u + 2.0 * k[6] * u * v + k[7] * v * v
    d[2, 1] = 1.0
    d[2, 2] = k[1] + k[3] * u + 2.0 * k[4] * v + k[6] * u * u + 2.0 * k[7] * u * v + 3.0 * k[8] * v * v
    d[3, 2] = 2.0 * k[2] + 6.0 * k[5] * u + 2.0 * k[6] * v
    d[4, 2] = k[3] + 2.0 * k[6] * u + 2.0 * k[7] * v
    d[5, 2] = 2.0 * k[4] + 2.0 * k[7] * u + 6.0 * k[8] * v


@compiled
def gauss_frame(d: FloatArray, frame: FloatArray, spin: FloatArray) -> None:
    """Write the Gauss frame and the matrix C of a chart point.

    With e1, e2, e3 the frame's axes, the k-th column of C is the angular velocity
    -e1 (e2 . d_k e3) + e2 (e1 . d_k e3) + e3 (e2 . d_k e1) of the frame per unit of coordinate k.

    Args:
        d: c and its derivatives, shape (6, 3), as of `chart_derivatives`.
        frame: The result R_c^o, shape (3, 3).
        spin: The result C, shape (3, 2).
    """
    length = math.sqrt(d[1, 0] ** 2 + d[1, 1] ** 2 + d[1, 2] ** 2)
    n0 = d[1, 1] * d[2, 2] - d[1, 2] * d[2, 1]
    n1 = d[1, 2] * d[2, 0] - d[1, 0] * d[2, 2]
    n2 = d[1, 0] * d[2, 1] - d[1, 1] * d[2, 0]
    area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    for i in range(3):
        frame[i, 0] = d[1, i] / length
    frame[0, 2], frame[1, 2], frame[2, 2] = n0 / area, n1 / area, n2 / area
    frame[0, 1] = frame[1, 2] * frame[2, 0] - frame[2, 2] * frame[1, 0]
    frame[1, 1] = frame[2, 2] * frame[0, 0] - frame[0, 2] * frame[2, 0]
    frame[2, 1] = frame[0, 2] * frame[1, 0] - frame[1, 2] * frame[0, 0]
    along, across = 0.0, area / length  # c_v in the frame: along e1 (0 if orthogonal) and e2
    for i in range(3):
        along += d[2, i] * frame[i, 0]
    for k in range(2):
        turn, bend1, bend2 = 0.0, 0.0, 0.0  # e2.d(e1), e1.d(e3), e2.d(e3)
        for i in range(3):
            turn += frame[i, 1] * d[3 + k, i] / length
            bend1 -= frame[i, 2] * d[3 + k, i] / length
            bend2 -= frame[i, 2] * d[4 + k, i] / across
        bend2 -= along * bend1 / across
        for i in range(3):
            spin[i, k] = -frame[i, 0] * bend2 + frame[i, 1] * bend1 + frame[i, 2] * turn
