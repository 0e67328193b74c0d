"""The grip plane: the least squares plane of the contacts, and the shape of the grasp in it."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled, inner


@dataclass(frozen=True)
class GripGeometry:
    """Shape of a grasp in its grip plane (thesis figure 3.8).

    Attributes:
        normal: Unit normal of the plane, contacts counter-clockwise about it in index order, shape (3,).
        centre: The centroid projected on the plane, shape (3,).
        angles_deg: Angle at `centre` from each contact to the next, shape (n_f,).
        equilateral_error_deg: Largest deviation of an angle from 360 / n_f.
        plane_offset_m: Distance of the centroid from the plane.
        flatness_m: Largest distance of a contact from the plane.
        area_m2: Area of the grasp polygon.
    """

    normal: FloatArray
    centre: FloatArray
    angles_deg: FloatArray
    equilateral_error_deg: float
    plane_offset_m: float
    flatness_m: float
    area_m2: float


def grip_geometry(points: FloatArray, centroid: FloatArray) -> GripGeometry:
    """Measure a grasp's shape in its grip plane.

    Args:
        points: Contacts in cyclic order, shape (n_f, 3), n_f >= 2.
        centroid: Centroid of the object, shape (3,).
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    centroid = np.ascontiguousarray(centroid, dtype=np.float64)
    normal, mean = fit_plane(points, centroid)
    heights = (points - mean) @ normal
    flat = points - heights[:, None] * normal
    offset = float((centroid - mean) @ normal)
    centre = centroid - offset * normal
    angles = np.empty(len(points))
    next_angles(flat, centre, normal, angles)
    degrees = np.rad2deg(angles)
    return GripGeometry(
        normal=normal,
        centre=centre,
        angles_deg=degrees,
        equilateral_error_deg=float(np.abs(degrees - 360.0 / len(points)).max()),
        plane_offset_m=abs(offset),
        flatness_m=float(np.abs(heights).max()),
        area_m2=0.5 * abs(float(np.cross(flat, np.roll(flat, -1, axis=0)).sum(axis=0) @ normal)),
    )


@compiled
def fit_plane(points: FloatArray, centroid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit the least squares plane of the contacts.

    Two contacts leave the plane free to turn about their line: it is then taken through the
    centroid, so that two opposed contacts have the centroid between them.

    Args:
        points: Shape (n_f, 3).
        centroid: Shape (3,), used for two contacts only.

    Returns:
        Unit normal, contacts counter-clockwise about it in index order, and the contacts' mean; shape (3,)
        each.
    """
    nx, ny, nz, mx, my, mz = plane_numbers(points, centroid)
    return np.array([nx, ny, nz]), np.array([mx, my, mz])


@inner
def plane_numbers(
    points: FloatArray, centroid: FloatArray
) -> tuple[float, float, float, float, float, float]:
    """Return what `fit_plane` does as six numbers: kernels that ask often need no arrays for them."""
    n_f = points.shape[0]
    mx = my = mz = 0.0
    for i in range(n_f):
        mx, my, mz = mx + points[i, 0] / n_f, my + points[i, 1] / n_f, mz + points[i, 2] / n_f
    ox, oy, oz = mx, my, mz
    if n_f == 2:
        ox, oy, oz = centroid[0], centroid[1], centroid[2]
    # The area vector: exact normal of a triangle, and the sense of rotation of any polygon.
    x = y = z = size = 0.0
    for i in range(n_f if n_f > 2 else 1):
        j = (i + 1) % n_f
        ax, ay, az = points[i, 0] - ox, points[i, 1] - oy, points[i, 2] - oz
        bx, by, bz = points[j, 0] - ox, points[j, 1] - oy, points[j, 2] - oz
        x += ay * bz - az * by
        y += az * bx - ax * bz
        z += ax * by - ay * bx
        size += ax * ax + ay * ay + az * az
    length = np.sqrt(x * x + y * y + z * z)
    if n_f > 3:
        direction = _least_scattered_direction(points, mx, my, mz)
        sense = 1.0 if direction[0] * x + direction[1] * y + direction[2] * z >= 0.0 else -1.0
        x, y, z = sense * direction[0], sense * direction[1], sense * direction[2]
    elif length > 1e-9 * size:
        x, y, z = x / length, y / length, z / length
    else:
        direction = _perpendicular(
            points[1, 0] - points[0, 0], points[1, 1] - points[0, 1], points[1, 2] - points[0, 2]
        )
        x, y, z = direction[0], direction[1], direction[2]
    return x, y, z, mx, my, mz


@compiled
def next_angles(flat: FloatArray, centre: FloatArray, normal: FloatArray, angles: FloatArray) -> None:
    """Measure the angle at ``centre`` from each contact to the next, counter-clockwise about ``normal``.

    Args:
        flat: Contacts projected on the plane, shape (n_f, 3).
        centre: Projected centroid, shape (3,).
        normal: Plane normal, shape (3,).
        angles: Output in [0, 2 pi), shape (n_f,).
    """
    n_f = flat.shape[0]
    for i in range(n_f):
        j = (i + 1) % n_f
        ax, ay, az = flat[i, 0] - centre[0], flat[i, 1] - centre[1], flat[i, 2] - centre[2]
        bx, by, bz = flat[j, 0] - centre[0], flat[j, 1] - centre[1], flat[j, 2] - centre[2]
        sine = (
            normal[0] * (ay * bz - az * by)
            + normal[1] * (az * bx - ax * bz)
            + normal[2] * (ax * by - ay * bx)
        )
        angle = np.arctan2(sine, ax * bx + ay * by + az * bz)
        angles[i] = angle if angle >= 0.0 else angle + 2.0 * np.pi


@inner
def _perpendicular(x: float, y: float, z: float) -> FloatArray:
    """Return some unit vector perpendicular to (x, y, z), always the same one."""
    out = np.zeros(3)
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        out[1], out[2] = z, -y
    elif abs(y) <= abs(z):
        out[0], out[2] = -z, x
    else:
        out[0], out[1] = y, -x
    size = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    if size > 0.0:
        out /= size
        return out
    out[2] = 1.0
    return out


@inner
def _least_scattered_direction(points: FloatArray, mx: float, my: float, mz: float) -> FloatArray:
    """Return the direction of least scatter: smallest eigenvector of the 3 x 3 scatter (cyclic Jacobi)."""
    matrix = np.zeros((3, 3))
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] - mx, points[i, 1] - my, points[i, 2] - mz
        matrix[0, 0] += x * x
        matrix[0, 1] += x * y
        matrix[0, 2] += x * z
        matrix[1, 1] += y * y
        matrix[1, 2] += y * z
        matrix[2, 2] += z * z
    matrix[1, 0], matrix[2, 0], matrix[2, 1] = matrix[0, 1], matrix[0, 2], matrix[1, 2]
    vectors = np.eye(3)
    for _ in range(12):
        off = matrix[0, 1] ** 2 + matrix[0, 2] ** 2 + matrix[1, 2] ** 2
        if off <= 1e-30 * (matrix[0, 0] ** 2 + matrix[1, 1] ** 2 + matrix[2, 2] ** 2):
            break
        for pair in range(3):
            p, q = (0, 1) if pair == 0 else ((0, 2) if pair == 1 else (1, 2))
            if matrix[p, q] == 0.0:
                continue
            tau = (matrix[q, q] - matrix[p, p]) / (2.0 * matrix[p, q])
            t = (1.0 if tau >= 0.0 else -1.0) / (abs(tau) + np.sqrt(1.0 + tau * tau))
            c = 1.0 / np.sqrt(1.0 + t * t)
            s = t * c
            for a in range(3):
                left, right = matrix[a, p], matrix[a, q]
                matrix[a, p], matrix[a, q] = c * left - s * right, s * left + c * right
                left, right = vectors[a, p], vectors[a, q]
                vectors[a, p], vectors[a, q] = c * left - s * right, s * left + c * right
            for a in range(3):
                left, right = matrix[p, a], matrix[q, a]
                matrix[p, a], matrix[q, a] = c * left - s * right, s * left + c * right
    smallest = 0
    for a in range(1, 3):
        if matrix[a, a] < matrix[smallest, smallest]:
            smallest = a
    direction: FloatArray = vectors[:, smallest].copy()
    return direction
