"""What is searched for, within which limits, and what is known at the end."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import comb
from typing import Annotated, Literal, TypeAlias, get_args

import numpy as np
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.planning.parameters import PHI_CEI_DEG, PHI_EEGI_DEG, PhiCeiDeg, PhiEegiDeg
from graspbench.planning.search.climb import PROGRESS
from graspbench.planning.search.referee import Referee
from graspbench.reconstruction.surface import Surface

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
    phi_cei_deg: Annotated[
        PhiCeiDeg | None,
        Field(description="Largest coplanarity error, deg; null: index.phi_cei_deg, or else 15"),
    ] = None
    phi_eegi_deg: Annotated[
        PhiEegiDeg | None,
        Field(description="Largest equilateral error, deg; null: index.phi_eegi_deg, or else 10"),
    ] = None

    @property
    def thresholds_deg(self) -> tuple[float, float]:
        """Largest coplanarity and equilateral errors of ``mirtich_canny``."""
        cei, eegi = self.phi_cei_deg, self.phi_eegi_deg
        return PHI_CEI_DEG if cei is None else cei, PHI_EEGI_DEG if eegi is None else eegi


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


@dataclass(frozen=True)
class Problem:
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
        """What torques are divided by, m."""
        return self.quality.torque_length_m(self.surface.points, self.surface.centroid)

    def out_of_time(self) -> bool:
        """Tell whether the time limit is over."""
        return time.perf_counter() - self.begin > self.search.time_limit_s

    def result(self, found: "Found", evaluate: Callable[[IntArray], float]) -> GlobalResult:
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
class Found:
    """What a search came to, with what the hand refused left out."""

    grasp: Grasp | None
    value: float
    upper_bound: float
    finished: bool
    evaluated: int
