"""The best of all Mirtich-Canny grasps on a surface: every triple of nodes, nothing sampled.

A triple can be within the thresholds only if its normals, two by two, enclose nearly 120 degrees; how nearly
follows from the thresholds. That leaves a few per cent of all triples. Of these the outer triangle is
measured first, since it needs no angle, and the errors only where it would beat the largest one so far.
"""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.indices.mirtich_canny import score_contacts
from graspbench.reconstruction.surface import Surface

_GRID = 61
_ROUNDING = 1e-9


@dataclass(frozen=True)
class OuterTriangleOptimum:
    """The largest outer triangle within the thresholds.

    Attributes:
        vertices: Its contacts, shape (3,); empty when no triple is within the thresholds.
        area_m2: Area of the outer triangle; 0 when there is none.
        triples: Number of triples of nodes, all of them considered.
        measured: Number of triples whose outer triangle was measured; no other can be within the thresholds.
        time_s: Time of the search.
    """

    vertices: IntArray
    area_m2: float
    triples: int
    measured: int
    time_s: float


def largest_outer_triangle(surface: Surface, phi_cei_deg: float, phi_eegi_deg: float) -> OuterTriangleOptimum:
    """Search all triples of nodes for the largest outer triangle within the thresholds (thesis A.2).

    Args:
        surface: The surface.
        phi_cei_deg: Largest coplanarity error.
        phi_eegi_deg: Largest equilateral error.
    """
    started = perf_counter()
    low, high = cosine_range(phi_cei_deg, phi_eegi_deg)
    cosines = surface.normals @ surface.normals.T
    compatible = (cosines >= low - _ROUNDING) & (cosines <= high + _ROUNDING)
    found = np.full(3, -1, dtype=np.int64)
    area, measured = _search(
        np.ascontiguousarray(surface.points),
        np.ascontiguousarray(surface.normals),
        compatible,
        np.array([phi_cei_deg, phi_eegi_deg]),
        found,
    )
    n = len(surface.points)
    return OuterTriangleOptimum(
        vertices=found[found >= 0],
        area_m2=float(area),
        triples=n * (n - 1) * (n - 2) // 6,
        measured=int(measured),
        time_s=perf_counter() - started,
    )


def cosine_range(phi_cei_deg: float, phi_eegi_deg: float) -> tuple[float, float]:
    """Return the least and the largest cosine between two normals of a grasp within the thresholds.

    The normals' tilts a, b out of the grip plane sum to at most 3 CEI. The three angles phi between their
    projections sum to 360 degrees when they surround a point, so one deviates from 120 degrees by at most
    half of their summed deviation, 1.5 EEGI. Their cosine is sin a sin b + cos a cos b cos phi.

    Args:
        phi_cei_deg: Largest coplanarity error.
        phi_eegi_deg: Largest equilateral error.
    """
    if 3.0 * phi_cei_deg >= 90.0:
        return -1.0, 1.0
    most, spread = np.deg2rad(3.0 * phi_cei_deg), np.deg2rad(min(1.5 * phi_eegi_deg, 60.0))
    # For fixed phi the only extremes inside |a| + |b| <= most are saddles.
    a = np.linspace(0.0, most, _GRID)
    b = most - a
    cosines = [
        sign * np.sin(a) * np.sin(b) + np.cos(a) * np.cos(b) * np.cos(2.0 * np.pi / 3.0 + turn)
        for sign in (1.0, -1.0)
        for turn in (-spread, spread)
    ]
    # Between grid points the extremes may be a little further out.
    slack = (most / (_GRID - 1)) ** 2
    return float(np.min(cosines)) - slack, float(np.max(cosines)) + slack


@compiled
def _search(
    points: FloatArray, normals: FloatArray, compatible: BoolArray, thresholds: FloatArray, found: IntArray
) -> tuple[float, int]:
    """Write the best triple; return its area and how many triples were measured."""
    contacts, directions, scores = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    later = np.empty(points.shape[0], dtype=np.int64)
    best, measured = 0.0, 0
    for i in range(points.shape[0]):
        count = 0
        for j in range(i + 1, points.shape[0]):
            if compatible[i, j]:
                later[count] = j
                count += 1
        for a in range(count):
            j = later[a]
            for b in range(a + 1, count):
                k = later[b]
                if not compatible[j, k]:
                    continue
                measured += 1
                if _outer_area(points, normals, i, j, k) <= best:
                    continue
                for c in range(3):
                    contacts[0, c], contacts[1, c], contacts[2, c] = points[i, c], points[j, c], points[k, c]
                    directions[0, c], directions[1, c] = normals[i, c], normals[j, c]
                    directions[2, c] = normals[k, c]
                score_contacts(contacts, directions, scores)
                if scores[0] <= thresholds[0] and scores[1] <= thresholds[1] and scores[2] > best:
                    best = scores[2]
                    found[0], found[1], found[2] = i, j, k
    return best, measured


@inner
def _outer_area(points: FloatArray, normals: FloatArray, i: int, j: int, k: int) -> float:
    """Return slightly more than the outer triangle's area, 0 when there is none.

    With w_jk the part of n_j x n_k along the plane's normal, and r_i the length of n_i in the plane, the
    sines between the projections are w_jk / (r_j r_k); in the area the lengths cancel.
    """
    ux, uy, uz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    vx, vy, vz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    gx, gy, gz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = np.sqrt(gx * gx + gy * gy + gz * gz)
    if size <= 0.0:
        return 0.0
    gx, gy, gz = gx / size, gy / size, gz / size
    ax, ay, az = normals[i, 0], normals[i, 1], normals[i, 2]
    bx, by, bz = normals[j, 0], normals[j, 1], normals[j, 2]
    cx, cy, cz = normals[k, 0], normals[k, 1], normals[k, 2]
    ab = (ay * bz - az * by) * gx + (az * bx - ax * bz) * gy + (ax * by - ay * bx) * gz
    bc = (by * cz - bz * cy) * gx + (bz * cx - bx * cz) * gy + (bx * cy - by * cx) * gz
    ca = (cy * az - cz * ay) * gx + (cz * ax - cx * az) * gy + (cx * ay - cy * ax) * gz
    if ab * bc <= 0.0 or bc * ca <= 0.0:
        return 0.0
    # Normals and contacts relative to contact i: u and v lie in the plane, so the normals need no projection.
    height = ca * (bx * ux + by * uy + bz * uz) + ab * (cx * vx + cy * vy + cz * vz)
    area: float = height * height / (2.0 * abs(ab * bc * ca)) * (1.0 + 1e-9)
    return area
