"""Global search: the best of all grasps on a reconstructed surface (thesis 3.6, serial approach)."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.planning.constraint import GraspConstraint
from graspbench.planning.search.engine import Progress
from graspbench.planning.search.parameters import (
    GLOBAL_MEASURES,
    GlobalMeasure,
    SearchParameters,
    check_measure,
)
from graspbench.planning.search.problem import Found, GlobalResult, Problem
from graspbench.planning.search.referee import Referee
from graspbench.planning.search.triangle_search import outer_triangle_m2, search_triangles
from graspbench.planning.search.wrench_search import search_wrenches
from graspbench.reconstruction.surface import Surface

__all__ = [
    "GLOBAL_MEASURES",
    "GlobalMeasure",
    "GlobalResult",
    "SearchParameters",
    "check_measure",
    "outer_triangle_m2",
    "plan_global",
]


def plan_global(
    surface: Surface,
    measure: str,
    n_f: int,
    quality: QualityParameters,
    search: SearchParameters,
    *,
    checker: GraspConstraint | None = None,
    centre_tolerance_m: float | None = None,
    starts: Sequence[Grasp] = (),
    on_begin: Callable[[Progress], None] | None = None,
) -> GlobalResult:
    """Find the best of all force closure grasps that the hand can hold, with a certificate.

    Q1 to Q3: best-first branch and bound over clusters of nodes; ``mirtich_canny``: all triples of nodes. The
    hand is asked only for grasps that would be the best so far. About what it refuses it is asked again at
    the end, from the postures of similar grasps and from many more starts; what it still refuses stays in the
    upper bound unless it is proved to be out of reach. When the time is up, the result holds the best grasp
    so far and the upper bound of all that was not looked at.

    Args:
        surface: The reconstructed surface at rest.
        measure: One of `GLOBAL_MEASURES`; ``mirtich_canny`` is the area of the outer triangle within the
            thresholds of its coplanarity and equilateral errors (thesis appendix A).
        n_f: Number of contacts, 2 to 5; 3 for ``mirtich_canny``.
        quality: Contact model and wrench space.
        search: Limits of the search.
        checker: The hand; None searches without one.
        centre_tolerance_m: Largest distance of the contacts' mean from the centroid (the thesis' k_cm = 1);
            None for any.
        starts: Grasps on this surface that the hand is known to hold, for example a local planner's and what
            it was refined to.
        on_begin: Called with how far the search is when it begins; what it is given goes on changing, so that
            another thread can look on.

    Raises:
        ConfigurationError: The measure is unknown, or the number of contacts is not supported.
    """
    begin = time.perf_counter()
    check_measure(measure, n_f)
    usable = np.ones(len(surface.points), dtype=np.bool_)
    limits = np.array([np.inf, np.inf if centre_tolerance_m is None else centre_tolerance_m])
    if checker is not None:
        usable = checker.vertex_mask(surface.points, surface.normals)
        limits[0] = checker.pair_limit_m
    referee = Referee(surface, checker, tuple(starts))
    problem = Problem(surface, measure, n_f, quality, search, usable, limits, referee, begin)
    if np.count_nonzero(usable) < n_f:
        return problem.result(Found(None, -np.inf, -np.inf, True, 0), lambda _: -np.inf)
    if measure == "mirtich_canny":
        return search_triangles(problem, starts, on_begin)
    return search_wrenches(problem, starts, on_begin)
