"""Refinement: climbing one quality measure from a grasp that is there, for example the local planner's.

A quality measure has many summits on a discretised surface, and most are not worth much. So a step looks
farther than the contours: one contact may move to any node of the surface. Where no single contact finds a
better place, two move together on their contours; where that does not help either, the grasp jumps to the
best of some random grasps that share all but two of its contacts, and climbs from there. It goes back when
that led to nothing, and stops after a few such jumps in a row. The same input gives the same result.
"""

from dataclasses import dataclass
from itertools import combinations
from time import perf_counter

import numpy as np

from graspbench.arrays import IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.hand.posture import HandPosture
from graspbench.planning.ascent import Measure
from graspbench.planning.constraint import GraspConstraint
from graspbench.planning.parameters import RefineParameters
from graspbench.reconstruction.surface import Surface

_PROGRESS = 1.0 + 1e-9  # less than rounding is no progress


@dataclass(frozen=True)
class RefinedGrasp:
    """A grasp at a summit of one measure, and how it was reached.

    Attributes:
        grasp: Force closure and within all constraints.
        measure: What was climbed.
        start_value: The measure where the climb began.
        value: The measure at the end; never less.
        steps: Moves that led from the first grasp to this one, jumps included.
        evaluated: Grasps whose measure was bounded or computed.
        placements: Grasps that the hand was asked to hold.
        time_s: Wall time.
    """

    grasp: Grasp
    measure: str
    start_value: float
    value: float
    steps: int
    evaluated: int
    placements: int
    time_s: float


def refine(
    grasp: Grasp,
    surface: Surface,
    measure: str,
    quality: QualityParameters,
    *,
    checker: GraspConstraint | None = None,
    centre_tolerance_m: float | None = None,
    parameters: RefineParameters | None = None,
) -> RefinedGrasp:
    """Climb a measure from a grasp, under the constraints of the global search.

    Args:
        grasp: Where to start, on ``surface``; force closure, and held by the hand if there is one.
        surface: The surface at rest.
        measure: "q1", "q2" or "q3".
        quality: How contacts and wrenches are modelled.
        checker: The hand's constraints; None for none.
        centre_tolerance_m: Largest distance of the contacts' mean from the centroid; None for any. A grasp
            that starts farther away may stay as far.
        parameters: How long to look.

    Raises:
        ConfigurationError: There is no such measure.
        PlanningError: The grasp to start from is not force closure.
    """
    started = perf_counter()
    climb = _Climb(Measure(measure, surface, quality), checker, centre_tolerance_m, grasp)
    start_value = climb.here.value
    climb.to_the_top(parameters or RefineParameters())
    best = climb.here
    found = Grasp(
        best.nodes, surface.points[best.nodes], surface.normals[best.nodes], surface.centroid, best.posture
    )
    return RefinedGrasp(
        grasp=found,
        measure=measure,
        start_value=start_value,
        value=best.value,
        steps=best.steps,
        evaluated=climb.evaluated,
        placements=climb.placements,
        time_s=perf_counter() - started,
    )


@dataclass(frozen=True)
class _Place:
    """A grasp on the way.

    Attributes:
        nodes: Its contacts, shape (n_f,).
        value: Its measure.
        posture: The hand that holds it.
        steps: Moves that led to it.
    """

    nodes: IntArray
    value: float
    posture: HandPosture | None
    steps: int


class _Climb:
    """A grasp on its way up, the constraints, and what it took."""

    def __init__(
        self, measure: Measure, checker: GraspConstraint | None, tolerance_m: float | None, grasp: Grasp
    ) -> None:
        self._measure, self._surface, self._checker = measure, measure.surface, checker
        usable = np.ones(len(self._surface.points), dtype=np.bool_)
        if checker is not None:
            usable = checker.vertex_mask(self._surface.points, self._surface.normals)
        self._usable = usable
        self._nodes = np.flatnonzero(usable)
        taken = float(np.linalg.norm(grasp.points.mean(axis=0) - self._surface.centroid))
        self._tolerance_m = None if tolerance_m is None else max(tolerance_m, taken * _PROGRESS)
        self.evaluated = self.placements = 0
        if not self._closed(grasp.vertices):
            raise PlanningError(
                "the grasp to refine is not force closure", remedy="start from one that the planner reports"
            )
        self.here = _Place(grasp.vertices, measure.value(grasp.vertices), grasp.posture, 0)

    def to_the_top(self, parameters: RefineParameters) -> None:
        """Climb to a summit, and from summit to summit until jumps find no higher one."""
        random = np.random.default_rng(parameters.seed)
        self.here = self._summit(self.here)
        failed = 0
        while failed < parameters.jumps:
            below = self.here.value * parameters.jump_down
            drawn = _some_pairs(self.here.nodes, self._nodes, parameters.draws, random)
            landed = self._best(drawn, below, self.here)
            top = None if landed is None else self._summit(landed)
            failed += 1
            if top is not None and top.value > self.here.value * _PROGRESS:
                self.here, failed = top, 0

    def _summit(self, place: _Place) -> _Place:
        """Climb until neither one contact anywhere nor two on their contours find a better place."""
        while True:
            higher = self._best(self._one_anywhere(place.nodes), place.value, place)
            if higher is None:
                higher = self._best(self._two_on_contours(place.nodes), place.value, place)
            if higher is None:
                return place
            place = higher

    def _one_anywhere(self, nodes: IntArray) -> IntArray:
        moved = np.tile(nodes, (len(nodes), len(self._nodes), 1))
        for i in range(len(nodes)):
            moved[i, :, i] = self._nodes
        return moved.reshape(-1, len(nodes))

    def _two_on_contours(self, nodes: IntArray) -> IntArray:
        contours = [self._surface.network.contour(int(node)) for node in nodes]
        moved = []
        for i, j in combinations(range(len(nodes)), 2):
            first, second = np.meshgrid(contours[i], contours[j], indexing="ij")
            grasps = np.tile(nodes, (first.size, 1))
            grasps[:, i], grasps[:, j] = first.ravel(), second.ravel()
            moved.append(grasps)
        return np.concatenate(moved)

    def _best(self, grasps: IntArray, floor: float, origin: _Place) -> _Place | None:
        """Return the best grasp above ``floor`` that meets all constraints; None if there is none."""
        grasps = self._within_reach(grasps)
        self.evaluated += len(grasps)
        posture: HandPosture | None = None

        def accept(nodes: IntArray) -> bool:
            nonlocal posture
            if not self._closed(nodes):
                return False
            if self._checker is None:
                return True
            points, normals = self._surface.points[nodes], self._surface.normals[nodes]
            self.placements += 1
            held = self._checker.place(points, normals, start=origin.posture)
            posture = held or posture
            return held is not None

        found = self._measure.best(grasps, floor * _PROGRESS, accept)
        return None if found is None else _Place(*found, posture, origin.steps + 1)

    def _within_reach(self, grasps: IntArray) -> IntArray:
        """Leave out grasps that touch a node twice, are too wide for the hand, or off the centroid."""
        points = self._surface.points
        keep = self._usable[grasps].all(axis=1)
        if self._tolerance_m is not None:
            mean = sum(points[grasps[:, i]] for i in range(grasps.shape[1])) / grasps.shape[1]
            keep &= np.linalg.norm(mean - self._surface.centroid, axis=1) <= self._tolerance_m
        grasps = grasps[keep]
        keep = np.ones(len(grasps), dtype=np.bool_)
        for i, j in combinations(range(grasps.shape[1]), 2):
            keep &= grasps[:, i] != grasps[:, j]
            if self._checker is not None:
                gap = points[grasps[:, i]] - points[grasps[:, j]]
                keep &= np.einsum("ij,ij->i", gap, gap) <= self._checker.pair_limit_m**2
        return grasps[keep]

    def _closed(self, nodes: IntArray) -> bool:
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        measure = self._measure
        closed = force_closure(
            points, -normals, self._surface.centroid, measure.quality, measure.torque_length_m
        )
        return bool(closed)


def _some_pairs(nodes: IntArray, among: IntArray, count: int, random: np.random.Generator) -> IntArray:
    """Return grasps with two random contacts each moved to random nodes, shape (count, n_f)."""
    grasps = np.tile(nodes, (count, 1))
    pairs = list(combinations(range(len(nodes)), 2))
    chosen = np.array(pairs)[random.integers(len(pairs), size=count)]
    grasps[np.arange(count)[:, None], chosen] = among[random.integers(len(among), size=(count, 2))]
    return grasps
