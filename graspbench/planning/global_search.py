"""Global search: the best of all grasps on a reconstructed surface (thesis 3.6, serial approach)."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import comb
from typing import Annotated, Literal, TypeAlias, get_args

import numpy as np
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.planning.constraint import GraspConstraint
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores
from graspbench.planning.mirtich_canny_optimum import largest_outer_triangle
from graspbench.planning.parameters import PHI_CEI_DEG, PHI_EEGI_DEG, PhiCeiDeg, PhiEegiDeg
from graspbench.planning.search.climb import PROGRESS, Climber, ContactsInTurn, Place, sampled_grasps
from graspbench.planning.search.engine import Progress, branch_and_bound
from graspbench.planning.search.layout import Layout, lay_out
from graspbench.planning.search.objectives import Objective, make_objective
from graspbench.planning.search.referee import Referee
from graspbench.reconstruction.surface import Surface
from graspbench.threads import threads_available

GlobalMeasure: TypeAlias = Literal["q1", "q2", "q3", "mirtich_canny"]

GLOBAL_MEASURES: tuple[GlobalMeasure, ...] = get_args(GlobalMeasure)
"""Measures that can be searched for."""


@dataclass(frozen=True)
class SearchParameters:
    """Limits of the global search."""

    enabled: Annotated[bool, Field(description="Search for the global optimum too")] = True
    measures: Annotated[
        tuple[GlobalMeasure, ...],
        Field(description="Measures whose optimum is searched; mirtich_canny is for 3 fingers"),
    ] = ("q1", "q2", "q3")
    refine: Annotated[
        bool, Field(description="Climb q1, q2 and q3 from the local grasp too (quality ascent)")
    ] = False
    time_limit_s: Annotated[float, Field(gt=0, le=86_400, description="Time limit per measure, s")] = 30.0
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

    The posture solver is numerical: that it finds no posture for a grasp proves nothing. So there are two
    bounds. ``upper_bound`` leaves out only what is proved to be out of reach; ``upper_bound_up_to_solver``
    leaves out what the solver did not find, too.

    Attributes:
        grasp: The best grasp; None if none was found.
        value: Its measure (m^2 for mirtich_canny); -inf if there is none.
        upper_bound: No grasp that meets the constraints has a larger measure: proved.
        gap: (upper_bound - value) / upper_bound; 1 while there is no grasp.
        optimal: Whether it is proved that no grasp is better (or that there is none at all).
        upper_bound_up_to_solver: No grasp that the posture solver finds a hand for has a larger measure.
        optimal_up_to_solver: Whether every grasp that would be better was refused by the posture solver.
        doubtful: Number of grasps that would be better, that the solver refused even after a long search, and
            that are not proved to be out of reach.
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
    upper_bound_up_to_solver: float
    optimal_up_to_solver: bool
    doubtful: int
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
    problem = _Problem(surface, measure, n_f, quality, search, usable, limits, referee, begin)
    if np.count_nonzero(usable) < n_f:
        return problem.result(_Found(None, -np.inf, -np.inf, True, 0), lambda _: -np.inf)
    if measure == "mirtich_canny":
        return _largest_outer_triangle(problem, starts)
    return _branch_and_bound(problem, starts)


@dataclass(frozen=True)
class _Problem:
    """What is searched, and with whom."""

    surface: Surface
    measure: str
    n_f: int
    quality: QualityParameters
    search: SearchParameters
    usable: BoolArray
    limits: FloatArray
    referee: Referee
    begin: float

    @property
    def torque_length_m(self) -> float:
        return self.quality.torque_length_m(self.surface.points, self.surface.centroid)

    def out_of_time(self) -> bool:
        return time.perf_counter() - self.begin > self.search.time_limit_s

    def result(self, found: "_Found", evaluate: Callable[[IntArray], float]) -> GlobalResult:
        """Ask the hand again about what it refused, and say what is known then.

        Args:
            found: What the search came to.
            evaluate: Returns the value of a grasp (nodes, shape (n_f,)); -inf if it is none.
        """
        least = found.value * PROGRESS if found.value > 0.0 else found.value
        verdict = self.referee.settle(least, evaluate, self.out_of_time)
        grasp, value = found.grasp, found.value
        if verdict.grasp is not None:
            grasp, value = verdict.grasp, verdict.value
        by_solver = max(found.upper_bound, value)
        upper_bound = max(by_solver, *verdict.doubtful) if verdict.doubtful else by_solver
        optimal = found.finished and not verdict.doubtful
        gap = 1.0 if value == -np.inf else max(0.0, (upper_bound - value) / upper_bound)
        return GlobalResult(
            grasp=grasp,
            value=value,
            upper_bound=upper_bound,
            gap=0.0 if optimal else gap,
            optimal=optimal,
            upper_bound_up_to_solver=by_solver,
            optimal_up_to_solver=found.finished,
            doubtful=len(verdict.doubtful),
            evaluated=found.evaluated,
            pruned=1.0 - found.evaluated / comb(len(self.surface.points), self.n_f),
            placements=self.referee.placements,
            time_s=time.perf_counter() - self.begin,
        )


@dataclass(frozen=True)
class _Found:
    """What a search came to, with what the hand refused left out."""

    grasp: Grasp | None
    value: float
    upper_bound: float
    finished: bool
    evaluated: int


def _branch_and_bound(problem: _Problem, starts: Sequence[Grasp]) -> GlobalResult:
    """Search for Q1, Q2 or Q3, beginning with the best start and some climbs."""
    surface, search, referee = problem.surface, problem.search, problem.referee
    layout = lay_out(
        surface.points, -surface.normals, surface.centroid, problem.quality, problem.torque_length_m,
        np.flatnonzero(problem.usable), problem.n_f, problem.limits,
    )  # fmt: skip
    objective = make_objective(layout, problem.measure)
    best = _best_start(starts, layout, objective)
    climber = Climber(layout, objective, referee, follow=True)
    begins = [best] if best is not None and search.climbs else []
    begins += [Place(leaves, -np.inf, None) for leaves in sampled_grasps(layout, objective, search.climbs)]
    for begin in begins:
        top = climber.climb(begin, ContactsInTurn(len(layout.nodes)))
        if top.grasp is not None and (best is None or top.value > best.value):
            best = top
    held = {} if best is None else {best.leaves.tobytes(): best.grasp}

    def accept(leaves: IntArray, value: float) -> float:
        held[leaves.tobytes()] = referee.hold(layout.nodes[leaves])
        return -np.inf if held[leaves.tobytes()] is None else value

    progress = branch_and_bound(
        layout, objective, problem.n_f, accept,
        gap=search.gap,
        threads=search.threads or threads_available(),
        out_of_time=problem.out_of_time,
        start=Progress(-np.inf, None, np.inf) if best is None else Progress(best.value, best.leaves, np.inf),
    )  # fmt: skip
    grasp = None if progress.tuple is None else held[progress.tuple.tobytes()]

    def evaluate(nodes: IntArray) -> float:
        leaves = layout.leaf_of[nodes][None]
        return float(objective.evaluate(leaves, progress.best)[0])

    return problem.result(
        _Found(grasp, progress.best, progress.upper_bound, progress.finished, progress.evaluated), evaluate
    )


def _best_start(starts: Sequence[Grasp], layout: Layout, objective: Objective) -> Place | None:
    """Return the best start that meets the constraints on nodes."""
    best: Place | None = None
    for start in starts:
        leaves = layout.leaves_of(start.vertices)
        if leaves is None or not layout.within_limits(leaves[None])[0]:
            continue
        value = float(objective.evaluate(leaves[None], -np.inf)[0])
        if value > (-np.inf if best is None else best.value):
            best = Place(leaves, value, start)
    return best


def _largest_outer_triangle(problem: _Problem, starts: Sequence[Grasp]) -> GlobalResult:
    """Enumerate all triples by Mirtich and Canny's criterion."""
    surface, search, length = problem.surface, problem.search, problem.torque_length_m
    best, value = None, -np.inf
    for start in starts:
        area = outer_triangle_m2(start, search)
        if area is not None and area > value:
            best, value = start, area
    held: Grasp | None = None

    def closed(nodes: IntArray) -> bool:
        points, normals_in = surface.points[nodes], -surface.normals[nodes]
        return bool(force_closure(points, normals_in, surface.centroid, problem.quality, length))

    def accept(nodes: IntArray) -> bool:
        nonlocal held
        held = problem.referee.hold(nodes) if closed(nodes) else None
        return held is not None

    found = largest_outer_triangle(
        surface,
        search.phi_cei_deg,
        search.phi_eegi_deg,
        usable=problem.usable,
        pair_limit_m=problem.limits[0],
        centre_tolerance_m=problem.limits[1],
        accept=accept,
        floor_m2=max(value, 0.0),
        out_of_time=problem.out_of_time,
    )
    if len(found.vertices):
        best, value = held, found.area_m2
    upper = value if found.finished else found.upper_bound_m2

    def evaluate(nodes: IntArray) -> float:
        return float(mirtich_canny_scores(surface.points[nodes], surface.normals[nodes])[2])

    return problem.result(_Found(best, value, upper, found.finished, found.measured), evaluate)


def outer_triangle_m2(grasp: Grasp, search: SearchParameters) -> float | None:
    """Return a grasp's value by ``mirtich_canny``, m^2; None when it is not within the thresholds."""
    cei, eegi, area = (float(score) for score in mirtich_canny_scores(grasp.points, grasp.normals))
    return area if cei <= search.phi_cei_deg and eegi <= search.phi_eegi_deg and area > 0.0 else None


def check_measure(measure: str, n_f: int) -> None:
    """Refuse a measure that cannot be searched for.

    Raises:
        ConfigurationError: The measure is unknown, or the number of contacts is not supported.
    """
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
