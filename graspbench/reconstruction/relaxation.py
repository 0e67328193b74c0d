"""Elastic relaxation of a dual net: nodes go to creases and corners, even out, and lie on the hull.

A node's sheet cuts its cell's edges in a few points, each with the hull's normal there. The node minimises
its distance to these tangent planes (Ju, Losasso, Schaefer and Warren, "Dual contouring of Hermite data",
2002) and the energy of springs to its neighbours. Springs are so weak that they only move a node where the
planes leave it free: along a face, or along a crease.
"""

from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.reconstruction.dual_net import DualNet
from graspbench.reconstruction.hull_fields import HullFields, critical_view_near, unseen, view_slope

LONGEST_STEP = 0.5
"""Longest way of a node in one step, in cells."""

PROJECTIONS = 2
"""Newton steps that put a node on the hull's border."""


ON_BORDER_M = 2e-5
"""A node this near to the border stays."""


class Planes(NamedTuple):
    """Mean of the tangent planes n . x = d of each node's sheet.

    Attributes:
        squares: Mean of n n^T, the upper triangle row by row, shape (n, 6).
        targets: Mean of d n, shape (n, 3).
        constants: Mean of d^2, shape (n,).
    """

    squares: FloatArray
    targets: FloatArray
    constants: FloatArray


def tangent_planes(fields: HullFields, net: DualNet) -> Planes:
    """Return the tangent planes where the border cuts the grid's edges, at the nodes around these.

    Args:
        fields: The visual hull's.
        net: As extracted.
    """
    size = len(net.points)
    planes = Planes(np.zeros((size, 6)), np.zeros((size, 3)), np.zeros(size))
    _sum_planes(fields, net.quads, net.crossings, planes)
    return planes


@compiled
def _sum_planes(fields: HullFields, quads: IntArray, crossings: FloatArray, planes: Planes) -> None:
    squares, targets, constants = planes
    number, seen = np.zeros(len(constants)), unseen(fields)
    for f in range(len(quads)):
        x, y, z = crossings[f, 0], crossings[f, 1], crossings[f, 2]
        view, distance = critical_view_near(fields, x, y, z, seen)
        _, gx, gy, gz = view_slope(fields, view, x, y, z)
        offset = gx * x + gy * y + gz * z - distance
        for k in range(4):
            n = quads[f, k]
            squares[n, 0] += gx * gx
            squares[n, 1] += gx * gy
            squares[n, 2] += gx * gz
            squares[n, 3] += gy * gy
            squares[n, 4] += gy * gz
            squares[n, 5] += gz * gz
            targets[n, 0] += offset * gx
            targets[n, 1] += offset * gy
            targets[n, 2] += offset * gz
            constants[n] += offset * offset
            number[n] += 1.0
    for n in range(len(constants)):
        for m in range(6):
            squares[n, m] /= number[n]
        for m in range(3):
            targets[n, m] /= number[n]
        constants[n] /= number[n]


@compiled
def relax(
    points: FloatArray, planes: Planes, quads: IntArray, stiffness: float, longest: float, means: FloatArray
) -> None:
    """Take one step: each node to the minimum of its planes' and its springs' energy, its neighbours held.

    Args:
        points: Node positions, shape (n, 3); overwritten.
        planes: Of the same nodes.
        quads: Springs run along their sides, shape (m, 4).
        stiffness: Of a node's springs together, against its planes.
        longest: Bound on a node's step (m).
        means: Work space, shape (n, 4).
    """
    squares, targets, _ = planes
    means[:] = 0.0
    for f in range(len(quads)):
        for k in range(4):
            # The side back is the next quadrilateral's.
            a, b = quads[f, k], quads[f, (k + 1) % 4]
            means[a, 0] += points[b, 0]
            means[a, 1] += points[b, 1]
            means[a, 2] += points[b, 2]
            means[a, 3] += 1.0
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        count = means[n, 3]
        s = squares[n]
        # Right side: how far the planes are from the node, and the springs' pull.
        rx = targets[n, 0] - (s[0] * x + s[1] * y + s[2] * z) + stiffness * (means[n, 0] / count - x)
        ry = targets[n, 1] - (s[1] * x + s[3] * y + s[4] * z) + stiffness * (means[n, 1] / count - y)
        rz = targets[n, 2] - (s[2] * x + s[4] * y + s[5] * z) + stiffness * (means[n, 2] / count - z)
        dx, dy, dz = _solve(
            s[0] + stiffness, s[1], s[2], s[3] + stiffness, s[4], s[5] + stiffness, rx, ry, rz
        )
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        share = longest / length if length > longest else 1.0
        points[n, 0], points[n, 1], points[n, 2] = x + share * dx, y + share * dy, z + share * dz


@compiled
def cut_quads(points: FloatArray, planes: Planes, quads: IntArray, faces: IntArray) -> None:
    """Cut each quadrilateral along the diagonal whose middle is nearer to the planes of its nodes.

    Args:
        points: Node positions, shape (n, 3).
        planes: Of the same nodes.
        quads: Shape (m, 4).
        faces: Output, shape (2 m, 3).
    """
    for f in range(len(quads)):
        errors = np.zeros(2)
        for turn in range(2):
            a, c = quads[f, turn], quads[f, turn + 2]
            x = 0.5 * (points[a, 0] + points[c, 0])
            y = 0.5 * (points[a, 1] + points[c, 1])
            z = 0.5 * (points[a, 2] + points[c, 2])
            for k in range(4):
                s, t = planes.squares[quads[f, k]], planes.targets[quads[f, k]]
                errors[turn] += (
                    s[0] * x * x + s[3] * y * y + s[5] * z * z
                    + 2.0 * (s[1] * x * y + s[2] * x * z + s[4] * y * z - t[0] * x - t[1] * y - t[2] * z)
                    + planes.constants[quads[f, k]]
                )  # fmt: skip
        turn = 0 if errors[0] <= errors[1] else 1
        a, b, c, d = quads[f, turn], quads[f, turn + 1], quads[f, turn + 2], quads[f, (turn + 3) % 4]
        faces[2 * f, 0], faces[2 * f, 1], faces[2 * f, 2] = a, b, c
        faces[2 * f + 1, 0], faces[2 * f + 1, 1], faces[2 * f + 1, 2] = a, c, d


@inner
def _solve(
    a: float, b: float, c: float, d: float, e: float, f: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Solve the symmetric equations [[a, b, c], [b, d, e], [c, e, f]] r = (x, y, z)."""
    p, q, r = d * f - e * e, c * e - b * f, b * e - c * d
    s, t, u = a * f - c * c, b * c - a * e, a * d - b * b
    inverse = 1.0 / (a * p + b * q + c * r)
    return (
        (p * x + q * y + r * z) * inverse,
        (q * x + s * y + t * z) * inverse,
        (r * x + t * y + u * z) * inverse,
    )


@compiled
def project(points: FloatArray, fields: HullFields, longest: float) -> None:
    """Put nodes on the hull's border by Newton steps, in place.

    Args:
        points: Near the border, shape (n, 3).
        fields: The visual hull's.
        longest: Bound on each step (m).
    """
    seen = unseen(fields)
    for n in range(len(points)):
        for _ in range(PROJECTIONS):
            x, y, z = points[n, 0], points[n, 1], points[n, 2]
            view, distance = critical_view_near(fields, x, y, z, seen)
            if abs(distance) < ON_BORDER_M:
                break
            _, gx, gy, gz = view_slope(fields, view, x, y, z)
            step = min(max(distance, -longest), longest)
            points[n, 0], points[n, 1], points[n, 2] = x - step * gx, y - step * gy, z - step * gz
