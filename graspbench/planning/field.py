"""Compiled force field and potential of the contacts (thesis 3.4.2, equation 3.2).

The coefficients are k_pi / l, k_cm / l, k_e / a, k_a in SI units, see
`graspbench.planning.indices.force_field`.
"""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled, inner
from graspbench.planning.grip_plane import fit_plane, next_angles, plane_numbers


@compiled
def mean_radius(points: FloatArray, centroid: FloatArray) -> float:
    """Return the mean distance of points, shape (n_s, 3), from the centroid."""
    total = 0.0
    for node in range(points.shape[0]):
        square = 0.0
        for a in range(3):
            square += (points[node, a] - centroid[a]) ** 2
        total += np.sqrt(square)
    return float(total / points.shape[0])


@compiled
def field(points: FloatArray, centroid: FloatArray, k: FloatArray, terms: FloatArray) -> None:
    """Write f_PI, f_cm, f_e, f_a of every contact, ``terms`` of shape (4, n_f, 3)."""
    n_f = points.shape[0]
    flat, centre = np.empty((n_f, 3)), np.empty(3)
    normal = _flatten(points, centroid, flat, centre)
    angles = np.empty(n_f)
    next_angles(flat, centre, normal, angles)
    outwards = np.empty(3)
    for i in range(n_f):
        square = 0.0
        for a in range(3):
            outwards[a] = flat[i, a] - centre[a]
            square += outwards[a] ** 2
        error = angles[i] - 2.0 * np.pi / n_f
        for a in range(3):
            outwards[a] = outwards[a] / np.sqrt(square) if square > 0.0 else 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            # The contacts are counter-clockwise about the normal, so this points to the next one.
            tangent = normal[b] * outwards[c] - normal[c] * outwards[b]
            terms[0, i, a] = k[0] * (flat[i, a] - points[i, a])
            terms[1, i, a] = k[1] * (centroid[a] - centre[a])
            terms[2, i, a] = k[2] * error * tangent
            terms[3, i, a] = k[3] * outwards[a]


@inner
def _flatten(points: FloatArray, centroid: FloatArray, flat: FloatArray, centre: FloatArray) -> FloatArray:
    """Write the projections of contacts and centroid on the grip plane; return its normal."""
    plane = fit_plane(points, centroid)
    normal: FloatArray = plane[0]
    mean = plane[1]
    offset = 0.0
    for a in range(3):
        offset += (centroid[a] - mean[a]) * normal[a]
    for a in range(3):
        centre[a] = centroid[a] - offset * normal[a]
    for i in range(points.shape[0]):
        height = 0.0
        for a in range(3):
            height += (points[i, a] - mean[a]) * normal[a]
        for a in range(3):
            flat[i, a] = points[i, a] - height * normal[a]
    return normal


@compiled
def potential(points: FloatArray, centroid: FloatArray, k: FloatArray, radius: float) -> float:
    """Return the potential of contacts of shape (n_f, 3), barrier left out, J."""
    n_f = points.shape[0]
    x, y, z, mx, my, mz = plane_numbers(points, centroid)
    offset = (centroid[0] - mx) * x + (centroid[1] - my) * y + (centroid[2] - mz) * z
    value = 0.5 * n_f * k[1] * offset * offset
    # Contacts from the projected centroid: what is along the normal is taken off the products below.
    j = n_f - 1
    ax, ay, az = points[j, 0] - centroid[0], points[j, 1] - centroid[1], points[j, 2] - centroid[2]
    height = ax * x + ay * y + az * z
    for i in range(n_f):
        bx, by, bz = points[i, 0] - centroid[0], points[i, 1] - centroid[1], points[i, 2] - centroid[2]
        rise = bx * x + by * y + bz * z
        sine = x * (ay * bz - az * by) + y * (az * bx - ax * bz) + z * (ax * by - ay * bx)
        angle = np.arctan2(sine, ax * bx + ay * by + az * bz - height * rise)
        error = (angle if angle >= 0.0 else angle + 2.0 * np.pi) - 2.0 * np.pi / n_f
        square = max(0.0, bx * bx + by * by + bz * bz - rise * rise)
        value += 0.5 * k[0] * (rise + offset) ** 2
        value += 0.25 * radius * k[2] * error * error - k[3] * np.sqrt(square)
        ax, ay, az, height = bx, by, bz, rise
    return float(value)
