"""What is searched for, within which limits, and what is known at the end."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import comb

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.planning.search.climb import PROGRESS
from graspbench.planning.search.parameters import SearchParameters
from graspbench.planning.search.referee import Referee
from graspbench.reconstruction.surface import Surface


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
