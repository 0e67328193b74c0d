"""The best of all Mirtich-Canny grasps on a surface: every triple of nodes, nothing sampled.

A triple can be within the thresholds only if its normals, two by two, enclose nearly 120 degrees; how nearly
follows from the thresholds. That leaves a few per cent of all triples. Of these the outer triangle is
measured first, since it needs no angle, and the errors only where it would be among the largest so far.
Who has to hold the grasp is asked about the largest ones in descending order: the first that is accepted is
the optimum.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.indices.mirtich_canny import score_contacts
from graspbench.planning.mirtich_canny_bounds import cosine_range, largest_possible_m2
from graspbench.reconstruction.surface import Surface

_ROUNDING = 1e-9
_LISTED = 512
"""Triples that are listed at a time for whoever has to accept them."""

_AT_ONCE = 64
"""First nodes whose triples are looked at between two looks at the clock."""


@dataclass(frozen=True)
class OuterTriangleOptimum:
    """The largest outer triangle within the thresholds.

    Attributes:
        vertices: Its contacts, shape (3,); empty when no accepted triple is larger than the floor.
        area_m2: Area of the outer triangle; the floor when there is none.
        upper_bound_m2: No triple that is within the thresholds and accepted has a larger one.
        finished: Whether every triple was considered; if not, the bound may be above the area.
        triples: Number of triples of nodes.
        measured: Number of triples whose outer triangle was measured; no other can be within the thresholds.
        time_s: Time of the search.
    """

    vertices: IntArray
    area_m2: float
    upper_bound_m2: float
    finished: bool
    triples: int
    measured: int
    time_s: float


def largest_outer_triangle(
    surface: Surface,
    phi_cei_deg: float,
    phi_eegi_deg: float,
    *,
    usable: BoolArray | None = None,
    pair_limit_m: float = np.inf,
    centre_tolerance_m: float = np.inf,
    accept: Callable[[IntArray], bool] | None = None,
    floor_m2: float = 0.0,
    out_of_time: Callable[[], bool] | None = None,
    on_bound: Callable[[float], None] = lambda _: None,
) -> OuterTriangleOptimum:
    """Search all triples of nodes for the largest outer triangle within the thresholds (thesis A.2).

    Args:
        surface: The surface.
        phi_cei_deg: Largest coplanarity error.
        phi_eegi_deg: Largest equilateral error.
        usable: Nodes that can be contacts, shape (n_s,); None for all.
        pair_limit_m: Largest distance of two contacts.
        centre_tolerance_m: Largest distance of the contacts' mean from the surface's centroid.
        accept: Asked whether a triple is a grasp, the largest first; None accepts each.
        floor_m2: Outer triangles that are not larger do not count.
        out_of_time: Asked now and then whether to stop.
        on_bound: Told, m^2, each time that less is known to be the most that there can be.
    """
    started = perf_counter()
    search = _Search(surface, phi_cei_deg, phi_eegi_deg, usable, pair_limit_m, centre_tolerance_m)
    out_of_time = out_of_time or (lambda: False)
    bound, chosen, finished = largest_possible_m2(surface, phi_eegi_deg), None, False
    on_bound(bound)
    listed = 1 if accept is None else _LISTED
    ceiling, last = np.inf, np.full(3, -1, dtype=np.int64)
    while chosen is None and not finished:
        triples, areas, complete = search.largest(listed, floor_m2, ceiling, last, out_of_time)
        if not complete:
            break
        for triple, area in zip(triples, areas, strict=True):
            bound = float(area)
            on_bound(bound)
            if out_of_time():
                break
            if accept is None or accept(triple):
                chosen = triple
                break
        else:
            finished = len(triples) < listed
            if len(triples):
                ceiling, last = float(areas[-1]), triples[-1]
    n = len(surface.points)
    return OuterTriangleOptimum(
        vertices=np.empty(0, dtype=np.int64) if chosen is None else chosen,
        area_m2=floor_m2 if chosen is None else bound,
        upper_bound_m2=floor_m2 if finished else bound,
        finished=finished or chosen is not None,
        triples=n * (n - 1) * (n - 2) // 6,
        measured=search.measured,
        time_s=perf_counter() - started,
    )


class _Search:
    """Lists the largest triples within thresholds and limits."""

    def __init__(
        self,
        surface: Surface,
        phi_cei_deg: float,
        phi_eegi_deg: float,
        usable: BoolArray | None,
        pair_limit_m: float,
        centre_tolerance_m: float,
    ) -> None:
        points, normals = surface.points, surface.normals
        low, high = cosine_range(phi_cei_deg, phi_eegi_deg)
        cosines = normals @ normals.T
        compatible = (cosines >= low - _ROUNDING) & (cosines <= high + _ROUNDING)
        if usable is not None:
            compatible &= usable[:, None] & usable[None, :]
        if pair_limit_m < np.inf:
            gaps = np.linalg.norm(points[:, None] - points[None], axis=-1)
            compatible &= gaps <= pair_limit_m
        self._points, self._normals = np.ascontiguousarray(points), np.ascontiguousarray(normals)
        self._centroid, self._compatible = np.ascontiguousarray(surface.centroid), compatible
        self._thresholds = np.array([phi_cei_deg, phi_eegi_deg, centre_tolerance_m])
        self.measured = 0

    def largest(
        self, count: int, floor: float, ceiling: float, last: IntArray, out_of_time: Callable[[], bool]
    ) -> tuple[IntArray, FloatArray, bool]:
        """Return the largest triples that come after one, their areas, and whether all were looked at.

        Args:
            count: How many to list at most.
            floor: Areas that are not larger do not count.
            ceiling: Area of the triple after which to go on.
            last: That triple; of equal areas the one with the lower nodes comes first.
            out_of_time: Asked now and then whether to stop.
        """
        triples, areas = np.empty((count, 3), dtype=np.int64), np.empty(count)
        found, measured = 0, 0
        for first in range(0, len(self._points), _AT_ONCE):
            if out_of_time():
                return triples[:0], areas[:0], False
            found, more = _list_largest(
                self._points, self._normals, self._centroid, self._compatible, self._thresholds,
                first, min(first + _AT_ONCE, len(self._points)), floor, ceiling, last, triples, areas, found,
            )  # fmt: skip
            measured += more
        self.measured = max(self.measured, measured)
        return triples[:found], areas[:found], True


@compiled
def _list_largest(
    points: FloatArray,
    normals: FloatArray,
    centroid: FloatArray,
    compatible: BoolArray,
    thresholds: FloatArray,
    first: int,
    end: int,
    floor: float,
    ceiling: float,
    last: IntArray,
    triples: IntArray,
    areas: FloatArray,
    found: int,
) -> tuple[int, int]:
    """Add the triples whose first node is in a range to a list of the largest, in descending order.

    Returns:
        How many are listed, and how many triples were measured.
    """
    contacts, directions, scores = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    later = np.empty(points.shape[0], dtype=np.int64)
    measured = 0
    for i in range(first, end):
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
                least = areas[found - 1] if found == areas.shape[0] else floor
                if _outer_area(points, normals, i, j, k) <= least:
                    continue
                for c in range(3):
                    contacts[0, c], contacts[1, c], contacts[2, c] = points[i, c], points[j, c], points[k, c]
                    directions[0, c], directions[1, c] = normals[i, c], normals[j, c]
                    directions[2, c] = normals[k, c]
                score_contacts(contacts, directions, scores)
                if scores[0] > thresholds[0] or scores[1] > thresholds[1] or scores[2] <= least:
                    continue
                if scores[2] > ceiling or (scores[2] == ceiling and not _comes_after(i, j, k, last)):
                    continue
                if _off_centre(contacts, centroid) > thresholds[2]:
                    continue
                at = found if found < areas.shape[0] else found - 1
                found = at + 1
                while at > 0 and areas[at - 1] < scores[2]:
                    areas[at] = areas[at - 1]
                    for c in range(3):
                        triples[at, c] = triples[at - 1, c]
                    at -= 1
                areas[at] = scores[2]
                triples[at, 0], triples[at, 1], triples[at, 2] = i, j, k
    return found, measured


@inner
def _comes_after(i: int, j: int, k: int, last: IntArray) -> bool:
    """Tell whether a triple comes after another one, node by node."""
    if i != last[0]:
        return bool(i > last[0])
    if j != last[1]:
        return bool(j > last[1])
    return bool(k > last[2])


@inner
def _off_centre(contacts: FloatArray, centroid: FloatArray) -> float:
    """Return the distance of the contacts' mean from the centroid."""
    square = 0.0
    for c in range(3):
        square += ((contacts[0, c] + contacts[1, c] + contacts[2, c]) / 3.0 - centroid[c]) ** 2
    return float(np.sqrt(square))


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
