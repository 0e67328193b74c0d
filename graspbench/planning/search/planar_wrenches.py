"""Wrenches of contacts in the plane of a frame: two unit vectors in the plane, and its normal."""

import math

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import inner


@inner
def contact_wrenches(
    frame: FloatArray, normal: FloatArray, arm: FloatArray, vertices: FloatArray, wrenches: FloatArray, i: int
) -> None:
    """Write the wrenches of contact i's corners in the plane of a frame."""
    basis = np.empty((3, 3))
    frictionless = vertices.shape[1] == 1
    for v in range(vertices.shape[0]):
        if frictionless:
            planar_wrench(frame, normal, arm, 0.0, wrenches[i])
            continue
        if v == 0:
            contact_basis(frame, normal, basis)
        force = np.empty(3)
        for k in range(3):
            force[k] = 0.0
            for j in range(3):
                force[k] += vertices[v, j] * basis[j, k]
        twist = 0.0
        if vertices.shape[1] == 4:
            for k in range(3):
                twist += vertices[v, 3] * frame[2, k] * normal[k]
        planar_wrench(frame, force, arm, twist, wrenches[i * vertices.shape[0] + v])


@inner
def planar_wrench(
    frame: FloatArray, force: FloatArray, arm: FloatArray, twist: float, out: FloatArray
) -> None:
    """Write a force's components in the plane and, if there is room, its moment about the plane's normal."""
    for j in range(2):
        out[j] = 0.0
        for k in range(3):
            out[j] += frame[j, k] * force[k]
    if out.shape[0] == 3:
        out[2] = twist
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            out[2] += frame[2, k] * (arm[a] * force[b] - arm[b] * force[a])


@inner
def contact_basis(frame: FloatArray, normal: FloatArray, basis: FloatArray) -> float:
    """Write a contact's tangent in the plane, the other one and the normal; return the plane's sine."""
    square = 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        basis[0, k] = frame[2, a] * normal[b] - frame[2, b] * normal[a]
        square += basis[0, k] ** 2
        basis[2, k] = normal[k]
    sine = math.sqrt(square)
    for k in range(3):
        basis[0, k] = basis[0, k] / sine if sine > 1e-6 else frame[0, k]
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        basis[1, k] = normal[a] * basis[0, b] - normal[b] * basis[0, a]
    return sine
