"""Small compiled helpers for rotations: XYZ Euler angles, logarithm and exponential."""

import math

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled, inner
from graspbench.manipulation.compiled.shared import shared

EULER_GUARD = 0.05
"""Smallest allowed cosine of the second XYZ Euler angle (about 87 deg) before the angles are given up."""


@inner
def matmul3(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Write the product of two (3, 3) matrices into ``out``, which must be neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@shared
def euler_matrix(angles: FloatArray, out: FloatArray) -> None:
    """Write R_x(a) R_y(b) R_z(c) of the XYZ Euler angles (a, b, c) into ``out``, shape (3, 3)."""
    ca, sa = math.cos(angles[0]), math.sin(angles[0])
    cb, sb = math.cos(angles[1]), math.sin(angles[1])
    cc, sc = math.cos(angles[2]), math.sin(angles[2])
    out[0, 0], out[0, 1], out[0, 2] = cb * cc, -cb * sc, sb
    out[1, 0], out[1, 1], out[1, 2] = ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb
    out[2, 0], out[2, 1], out[2, 2] = sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb


@inner
def euler_rates(angles: FloatArray, out: FloatArray) -> None:
    """Write T into ``out``, shape (3, 3): angular velocity in the first frame = T angles' (thesis 4.6)."""
    ca, sa = math.cos(angles[0]), math.sin(angles[0])
    cb, sb = math.cos(angles[1]), math.sin(angles[1])
    out[0, 0], out[0, 1], out[0, 2] = 1.0, 0.0, sb
    out[1, 0], out[1, 1], out[1, 2] = 0.0, ca, -sa * cb
    out[2, 0], out[2, 1], out[2, 2] = 0.0, sa, ca * cb


def euler_angles(rotation: FloatArray) -> FloatArray:
    """Return the XYZ Euler angles of a rotation, shape (3,), the second one within +-90 deg."""
    return np.array(
        [
            math.atan2(-rotation[1, 2], rotation[2, 2]),
            math.atan2(rotation[0, 2], math.hypot(rotation[0, 0], rotation[0, 1])),
            math.atan2(-rotation[0, 1], rotation[0, 0]),
        ]
    )


@shared
def axis_angle_matrix(axis: FloatArray, angle: float, out: FloatArray) -> None:
    """Write the rotation by ``angle`` about the unit vector ``axis`` into ``out`` (Rodrigues)."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    d = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + x * x * d, x * y * d - z * s, x * z * d + y * s
    out[1, 0], out[1, 1], out[1, 2] = x * y * d + z * s, c + y * y * d, y * z * d - x * s
    out[2, 0], out[2, 1], out[2, 2] = x * z * d - y * s, y * z * d + x * s, c + z * z * d


@compiled
def rotation_error(desired: FloatArray, actual: FloatArray, out: FloatArray) -> None:
    """Write the rotation vector of ``desired actual^T`` into ``out``, shape (3,), base frame, rad.

    This is the logarithm of the error rotation: its length is the angle left to turn, whatever the
    size of the error, and it has no representation singularity below 180 deg.
    """
    trace = 0.0
    for i in range(3):
        for k in range(3):
            trace += desired[i, k] * actual[i, k]
    vee = np.zeros(3)
    for k in range(3):
        vee[0] += desired[2, k] * actual[1, k] - desired[1, k] * actual[2, k]
        vee[1] += desired[0, k] * actual[2, k] - desired[2, k] * actual[0, k]
        vee[2] += desired[1, k] * actual[0, k] - desired[0, k] * actual[1, k]
    twice_sine = math.sqrt(vee[0] ** 2 + vee[1] ** 2 + vee[2] ** 2)
    angle = math.atan2(twice_sine, trace - 1.0)
    if twice_sine > 1e-9:
        factor = angle / twice_sine
        for i in range(3):
            out[i] = factor * vee[i]
    elif trace > 0.0:
        for i in range(3):
            out[i] = 0.5 * vee[i]
    else:  # half a turn: the axis is the largest column of the error rotation + 1
        column, length = 0, -2.0
        for k in range(3):
            diagonal = 0.0
            for i in range(3):
                diagonal += desired[k, i] * actual[k, i]
            if diagonal > length:
                column, length = k, diagonal
        scale = math.pi / math.sqrt(max(2.0 * (length + 1.0), 1e-12))
        for i in range(3):
            entry = 1.0 if i == column else 0.0
            for k in range(3):
                entry += desired[i, k] * actual[column, k]
            out[i] = scale * entry


@compiled
def turn(vector: FloatArray, share: float, rotation: FloatArray) -> FloatArray:
    """Return ``rotation`` turned by the share of a rotation vector in the base frame, shape (3, 3)."""
    angle = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle == 0.0:
        return rotation.copy()
    matrix, out = np.empty((3, 3)), np.empty((3, 3))
    axis_angle_matrix(vector / angle, share * angle, matrix)
    matmul3(matrix, rotation, out)
    return out


def rotation_matrix(vector: FloatArray) -> FloatArray:
    """Return the rotation by ``|vector|`` about ``vector``, shape (3, 3)."""
    matrix: FloatArray = turn(np.array(vector, dtype=np.float64), 1.0, np.eye(3))
    return matrix
