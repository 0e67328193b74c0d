"""Global search: the best of all grasps on a reconstructed surface (thesis 3.6, serial approach)."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, Protocol

import numpy as np
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.hand.posture import HandPosture
from graspbench.planning.ascent import Measure, climb
from graspbench.reconstruction.surface import Surface

# Nodes that are combined, by the number of contacts: some 10 000 to 60 000 combinations.
_SAMPLE = {2: 300, 3: 70, 4: 32}


class GraspConstraint(Protocol):
    """What the search asks of a hand; normals point out of the object."""

    pair_limit_m: float

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Tell which single contacts can be part of any grasp, shape (n,)."""
        ...

    def place(
        self, points: FloatArray, normals: FloatArray, *, start: HandPosture | None = None
    ) -> HandPosture | None:
        """Return a posture that holds the contacts, or None."""
        ...


@dataclass(frozen=True)
class SearchParameters:
    """Limits of the global search."""

    enabled: Annotated[bool, Field(description="Search for the global optimum too")] = True
    measures: Annotated[tuple[str, ...], Field(description="Measures whose global optimum is searched")] = (
        "q1",
        "q2",
        "q3",
    )
    time_limit_s: Annotated[float, Field(gt=0, description="Time limit per measure, s")] = 30.0
    gap: Annotated[float, Field(ge=0, lt=1, description="Relative gap at which the search may stop")] = 0.0
    climbs: Annotated[int, Field(ge=1, description="Sampled grasps from which the measure is climbed")] = 4
    centre_tolerance_m: Annotated[
        float,
        Field(gt=0, description="Distance of the centre of grip from the centroid allowed when k_cm > 0, m"),
    ] = 0.01


@dataclass(frozen=True)
class GlobalResult:
    """The best grasp found, and what is known about all others.

    Attributes:
        grasp: The best grasp; None if there is none.
        value: Its measure; -inf if there is none.
        upper_bound: No grasp that meets the constraints has a larger measure.
        gap: (upper_bound - value) / upper_bound.
        optimal: Whether the grasp is certified to be the best of all.
        evaluated: Number of grasps whose measure was computed.
        pruned: Share of all vertex combinations that was excluded without being evaluated.
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
    starts: Sequence[IntArray] = (),
) -> GlobalResult:
    """Search a surface for the best grasp by a measure.

    All combinations of an even sample of the nodes are ranked; from the best of them that meet the
    constraints, and from ``starts``, the measure is climbed over the whole surface. That is no certificate:
    ``optimal`` is False and the upper bound infinite.

    Args:
        surface: The surface at rest.
        measure: "q1", "q2" or "q3".
        n_f: Number of contacts.
        quality: How contacts and wrenches are modelled.
        search: Limits.
        checker: The hand's constraints; None for none.
        centre_tolerance_m: Largest distance of the contacts' mean from the centroid; None for any.
        starts: Grasps to climb from as well, shape (n_f,) each.

    Raises:
        ConfigurationError: There is no such measure.
    """
    begin = time.perf_counter()
    task = _Task(Measure(measure, surface, quality), checker, centre_tolerance_m)
    tuples = task.near_enough(_sampled_tuples(surface, n_f, checker))
    bounds = task.measure.bounds(tuples, tight=False) if len(tuples) else np.empty(0)
    best, value = None, -np.inf
    evaluated, climbs = len(tuples), 0
    for nodes in (*starts, *(tuples[k] for k in np.argsort(-bounds, kind="stable"))):
        if climbs >= search.climbs + len(starts) or time.perf_counter() - begin > search.time_limit_s:
            break
        if not task.allowed(nodes):
            continue
        climbs += 1
        top, found, count = climb(nodes, task.measure.value(nodes), task.measure, task.allowed)
        evaluated += count
        if found > value:
            best, value = top, found
    return GlobalResult(
        grasp=None if best is None else task.grasp(best),
        value=value,
        upper_bound=np.inf,
        gap=1.0,
        optimal=False,
        evaluated=evaluated,
        pruned=0.0,
        placements=task.placements,
        time_s=time.perf_counter() - begin,
    )


def _sampled_tuples(surface: Surface, n_f: int, checker: GraspConstraint | None) -> IntArray:
    """Return all combinations of an even sample of the nodes that may be contacts, shape (n, n_f)."""
    usable = np.arange(len(surface.points))
    if checker is not None:
        usable = usable[checker.vertex_mask(surface.points, surface.normals)]
    limit = _SAMPLE.get(n_f, 22)
    usable = usable[np.linspace(0, len(usable) - 1, min(limit, len(usable))).astype(int)]
    return np.array(list(combinations(usable, n_f)), dtype=np.int64).reshape(-1, n_f)


class _Task:
    """The constraints of a search, and what was asked of the hand."""

    def __init__(
        self, measure: Measure, checker: GraspConstraint | None, centre_tolerance_m: float | None
    ) -> None:
        self.measure = measure
        self._surface, self._checker, self._tolerance = measure.surface, checker, centre_tolerance_m
        self._usable = np.ones(len(self._surface.points), dtype=np.bool_)
        if checker is not None:
            self._usable = checker.vertex_mask(self._surface.points, self._surface.normals)
        self.placements = 0

    def near_enough(self, tuples: IntArray) -> IntArray:
        """Leave out combinations that are too wide for the hand or off the centroid."""
        points = self._surface.points[tuples]
        keep = np.ones(len(tuples), dtype=np.bool_)
        if self._tolerance is not None:
            offset = np.linalg.norm(points.mean(axis=1) - self._surface.centroid, axis=1)
            keep &= offset <= self._tolerance
        if self._checker is not None:
            for a, b in combinations(range(tuples.shape[1]), 2):
                gap = np.linalg.norm(points[:, a] - points[:, b], axis=1)
                keep &= gap <= self._checker.pair_limit_m
        return tuples[keep]

    def allowed(self, nodes: IntArray) -> bool:
        """Tell whether a grasp is force closure and meets all constraints."""
        if not self._usable[nodes].all() or not len(self.near_enough(nodes[None])):
            return False
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        length = self.measure.torque_length_m
        if not force_closure(points, -normals, self._surface.centroid, self.measure.quality, length):
            return False
        if self._checker is None:
            return True
        self.placements += 1
        return self._checker.place(points, normals) is not None

    def grasp(self, nodes: IntArray) -> Grasp:
        """Return the grasp with the posture that holds it."""
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        posture = None if self._checker is None else self._checker.place(points, normals)
        return Grasp(nodes, points, normals, self._surface.centroid, posture)
