"""Global search: the best of all grasps on a reconstructed surface (thesis 3.6, serial approach)."""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import IntArray
from graspbench.errors import ConfigurationError
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.planning.constraint import GraspConstraint
from graspbench.planning.parameters import PHI_CEI_DEG, PHI_EEGI_DEG, PhiCeiDeg, PhiEegiDeg
from graspbench.planning.search.climb import climb, sampled_grasps
from graspbench.planning.search.engine import Progress, branch_and_bound
from graspbench.planning.search.layout import Layout, lay_out
from graspbench.planning.search.objectives import Objective, make_objective
from graspbench.reconstruction.surface import Surface

GLOBAL_MEASURES = ("q1", "q2", "q3", "mirtich_canny")
"""Measures that can be searched for."""


@dataclass(frozen=True)
class SearchParameters:
    """Limits of the global search."""

    enabled: Annotated[bool, Field(description="Search for the global optimum too")] = True
    measures: Annotated[
        tuple[str, ...],
        Field(description="Measures whose optimum is searched: q1, q2, q3, mirtich_canny"),
    ] = ("q1", "q2", "q3")
    refine: Annotated[
        bool, Field(description="Climb q1, q2 and q3 from the local grasp too (quality ascent)")
    ] = False
    time_limit_s: Annotated[float, Field(gt=0, description="Time limit per measure, s")] = 30.0
    gap: Annotated[float, Field(ge=0, lt=1, description="Relative gap at which the search may stop")] = 0.0
    threads: Annotated[int, Field(ge=0, le=64, description="Threads; 0: as many as there are cores")] = 0
    climbs: Annotated[
        int, Field(ge=0, le=64, description="Climbs from sampled grasps, for a first one to beat")
    ] = 4
    centre_tolerance_m: Annotated[
        float,
        Field(gt=0, description="Distance of the centre of grip from the centroid allowed when k_cm > 0, m"),
    ] = 0.01
    phi_cei_deg: PhiCeiDeg = PHI_CEI_DEG
    phi_eegi_deg: PhiEegiDeg = PHI_EEGI_DEG


@dataclass(frozen=True)
class GlobalResult:
    """The best grasp found, and what is known about all others.

    Attributes:
        grasp: The best grasp; None if none was found.
        value: Its measure (m^2 for mirtich_canny); -inf if there is none.
        upper_bound: No grasp that meets the constraints has a larger measure.
        gap: (upper_bound - value) / upper_bound; 1 while there is no grasp.
        optimal: Whether it is certified that no grasp is better (or that there is none at all).
        evaluated: Number of grasps whose measure was computed.
        pruned: Share of all combinations of nodes that was excluded without being evaluated.
        placements: Number of grasps that the hand was asked to hold.
        time_s: Wall time.
    """

    grasp: Grasp | None
    value: float
    upper_bound: float
    gap: float
    optimal: bool
    evaluated: int
    pruned: float
    placements: int
    time_s: float


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
) -> GlobalResult:
    """Find the best of all force closure grasps that the hand can hold, with a certificate.

    Best-first branch and bound over clusters of nodes. The hand is asked only for grasps that would be the
    best so far. When the time is up, the result holds the best grasp so far and the upper bound of all
    that was not looked at.

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
        starts: Grasps on this surface that the hand is known to hold, for example a local planner's.

    Raises:
        ConfigurationError: The measure is unknown, or the number of contacts is not supported.
    """
    begin = time.perf_counter()
    _check(measure, n_f)
    torque_length = quality.torque_length_m(surface.points, surface.centroid)
    usable = np.arange(len(surface.points))
    limits = np.array([np.inf, np.inf if centre_tolerance_m is None else centre_tolerance_m])
    if checker is not None:
        usable = usable[checker.vertex_mask(surface.points, surface.normals)]
        limits[0] = checker.pair_limit_m
    if len(usable) < n_f:
        return GlobalResult(None, -np.inf, -np.inf, 1.0, True, 0, 1.0, 0, time.perf_counter() - begin)
    layout = lay_out(
        surface.points, -surface.normals, surface.centroid, quality, torque_length, usable, n_f, limits
    )
    thresholds = (search.phi_cei_deg, search.phi_eegi_deg)
    objective = make_objective(layout, measure, thresholds)
    referee = _Referee(layout, surface, checker)
    progress = Progress(-np.inf, None, np.inf)
    _adopt_best(starts, layout, objective, referee, progress)
    _climb_first(layout, objective, referee, progress, search.climbs)
    branch_and_bound(
        layout, objective, n_f, referee.accept,
        gap=search.gap,
        threads=search.threads or len(os.sched_getaffinity(0)),
        out_of_time=lambda: time.perf_counter() - begin > search.time_limit_s,
        start=progress,
    )  # fmt: skip
    return _result(progress, referee, comb(len(surface.points), n_f), begin)


class _Referee:
    """Asks the hand, and remembers the best grasp that it can hold."""

    def __init__(self, layout: Layout, surface: Surface, checker: GraspConstraint | None) -> None:
        self._layout = layout
        self._surface = surface
        self._checker = checker
        self.placements = 0
        self.grasp: Grasp | None = None

    def accept(self, leaves: IntArray, value: float) -> float:
        """Remember a grasp if the hand can hold it, and return its value; else -inf."""
        grasp = self._held(leaves)
        if grasp is None:
            return -np.inf
        self.grasp = grasp
        return value

    def judge(self, leaves: IntArray, value: float) -> float:
        """Return the value of a grasp that the hand can hold; else -inf."""
        return -np.inf if self._held(leaves) is None else value

    def _held(self, leaves: IntArray) -> Grasp | None:
        nodes = self._layout.nodes[leaves]
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        posture = None
        if self._checker is not None:
            self.placements += 1
            posture = self._checker.place(points, normals)
            if posture is None:
                return None
        return Grasp(nodes, points, normals, self._surface.centroid, posture)


def _adopt_best(
    starts: Sequence[Grasp],
    layout: Layout,
    objective: Objective,
    referee: _Referee,
    progress: Progress,
) -> None:
    """Begin with the best start that meets the constraints on nodes."""
    leaf_of = {int(node): leaf for leaf, node in enumerate(layout.nodes)}
    for start in starts:
        if not all(int(node) in leaf_of for node in start.vertices):
            continue
        leaves = np.array([leaf_of[int(node)] for node in start.vertices], dtype=np.int64)
        if not layout.within_limits(leaves[None])[0]:
            continue
        value = float(objective.evaluate(leaves[None], -np.inf)[0])
        if value > progress.best:
            progress.best, progress.tuple = value, leaves
            referee.grasp = start


def _climb_first(
    layout: Layout,
    objective: Objective,
    referee: _Referee,
    progress: Progress,
    climbs: int,
) -> None:
    """Climb from the best start and from sampled grasps."""
    begins = [] if progress.tuple is None or not climbs else [(progress.tuple, progress.best)]
    begins += [(leaves, -np.inf) for leaves in sampled_grasps(layout, objective, climbs)]
    for leaves, value in begins:
        leaves, value = climb(layout, objective, referee.judge, leaves, value)
        if value > progress.best and referee.accept(leaves, value) > progress.best:
            progress.best, progress.tuple = value, leaves


def _result(progress: Progress, referee: _Referee, total: int, begin: float) -> GlobalResult:
    best, upper = progress.best, progress.upper_bound
    gap = 1.0 if best == -np.inf else max(0.0, (upper - best) / upper)
    return GlobalResult(
        grasp=referee.grasp,
        value=best,
        upper_bound=upper,
        gap=0.0 if progress.finished else gap,
        optimal=progress.finished,
        evaluated=progress.evaluated,
        pruned=1.0 - progress.evaluated / total,
        placements=referee.placements,
        time_s=time.perf_counter() - begin,
    )


def _check(measure: str, n_f: int) -> None:
    if measure not in GLOBAL_MEASURES:
        raise ConfigurationError(
            f"unknown measure '{measure}' for the global search",
            remedy=f"choose from {', '.join(GLOBAL_MEASURES)}",
        )
    if not 2 <= n_f <= 5:
        raise ConfigurationError(f"global search for {n_f} contacts", remedy="choose 2 to 5")
    if measure == "mirtich_canny" and n_f != 3:
        raise ConfigurationError(
            f"the Mirtich-Canny criterion for {n_f} contacts", remedy="it is defined for 3 fingers"
        )
