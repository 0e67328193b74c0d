"""Search for the largest outer triangle (Mirtich and Canny's criterion, thesis appendix A)."""

from collections.abc import Callable, Sequence

import numpy as np

from graspbench.arrays import IntArray
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores
from graspbench.planning.mirtich_canny_optimum import largest_outer_triangle
from graspbench.planning.search.engine import Progress
from graspbench.planning.search.parameters import SearchParameters
from graspbench.planning.search.problem import Found, GlobalResult, Problem


def search_triangles(
    problem: Problem, starts: Sequence[Grasp], on_begin: Callable[[Progress], None] | None = None
) -> GlobalResult:
    """Enumerate all triples by Mirtich and Canny's criterion; tell how far it is.

    The triples are tried in descending order, so what falls is the bound: the first that is held is the best.
    """
    surface, search, length = problem.surface, problem.search, problem.torque_length_m
    best, value = None, -np.inf
    for start in starts:
        area = outer_triangle_m2(start, search)
        if area is not None and area > value:
            best, value = start, area
    held: Grasp | None = None
    progress = Progress(value, None, np.inf)
    if on_begin is not None:
        on_begin(progress)

    def fall_to(bound: float) -> None:
        progress.upper_bound = bound

    def closed(nodes: IntArray) -> bool:
        points, normals_in = surface.points[nodes], -surface.normals[nodes]
        return bool(force_closure(points, normals_in, surface.centroid, problem.quality, length))

    def accept(nodes: IntArray) -> bool:
        nonlocal held
        held = problem.referee.hold(nodes) if closed(nodes) else None
        return held is not None

    found = largest_outer_triangle(
        surface,
        *search.thresholds_deg,
        usable=problem.usable,
        pair_limit_m=problem.limits[0],
        centre_tolerance_m=problem.limits[1],
        accept=accept,
        floor_m2=max(value, 0.0),
        out_of_time=problem.out_of_time,
        on_bound=fall_to,
    )
    if len(found.vertices):
        best, value = held, found.area_m2
    upper = value if found.finished else found.upper_bound_m2
    progress.best, progress.upper_bound, progress.finished = value, upper, found.finished

    def evaluate(nodes: IntArray) -> float:
        return float(mirtich_canny_scores(surface.points[nodes], surface.normals[nodes])[2])

    return problem.result(Found(best, value, upper, found.finished, found.measured), evaluate)


def outer_triangle_m2(grasp: Grasp, search: SearchParameters) -> float | None:
    """Return a grasp's value by ``mirtich_canny``, m^2; None when it is not within the thresholds."""
    cei, eegi, area = (float(score) for score in mirtich_canny_scores(grasp.points, grasp.normals))
    max_cei, max_eegi = search.thresholds_deg
    return area if cei <= max_cei and eegi <= max_eegi and area > 0.0 else None
