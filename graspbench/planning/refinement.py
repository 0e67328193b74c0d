"""Refinement: climbing one quality measure from a grasp that is there, for example the local planner's.

A quality measure has many summits on a discretised surface, and most are not worth much. So a step looks
farther than the contours: one contact may move to any node of the surface. Where no single contact finds a
better place, two move together on their contours; where that does not help either, the grasp jumps to the
best of some random grasps that share all but two of its contacts, and climbs from there. It goes back when
that led to nothing, and stops after a few such jumps in a row. The same input gives the same result.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from time import perf_counter

import numpy as np

from graspbench.arrays import IntArray
from graspbench.errors import ConfigurationError, PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import THESIS_MEASURES, QualityParameters
from graspbench.planning.constraint import GraspConstraint
from graspbench.planning.parameters import RefineParameters
from graspbench.planning.search.climb import PROGRESS, Climber, Place
from graspbench.planning.search.layout import Layout, lay_out
from graspbench.planning.search.objectives import make_objective
from graspbench.planning.search.referee import Referee
from graspbench.reconstruction.network import SurfaceNetwork
from graspbench.reconstruction.surface import Surface


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
    if measure not in THESIS_MEASURES:
        raise ConfigurationError(
            f"unknown measure '{measure}'", remedy=f"choose from {', '.join(THESIS_MEASURES)}", name=measure
        )
    layout = _lay_out(grasp, surface, quality, checker, centre_tolerance_m)
    objective, referee = make_objective(layout, measure), Referee(surface, checker, (grasp,))
    leaves = layout.leaves_of(grasp.vertices)
    value = -np.inf if leaves is None else float(objective.evaluate(leaves[None], -np.inf)[0])
    if leaves is None or value == -np.inf:
        raise PlanningError(
            "the grasp to refine is not force closure", remedy="start from one that the planner reports"
        )
    climber = Climber(layout, objective, referee, follow=True)
    neighbours = _Neighbours(layout, surface.network)
    top = _to_the_top(
        climber, neighbours, Place(leaves, value, grasp), layout, parameters or RefineParameters()
    )
    assert top.grasp is not None, "every grasp on the way is held"
    return RefinedGrasp(
        grasp=top.grasp,
        measure=measure,
        start_value=value,
        value=top.value,
        steps=top.steps,
        evaluated=climber.looked_at,
        placements=referee.placements,
        time_s=perf_counter() - started,
    )


def _lay_out(
    grasp: Grasp,
    surface: Surface,
    quality: QualityParameters,
    checker: GraspConstraint | None,
    tolerance_m: float | None,
) -> Layout:
    usable, limits = np.arange(len(surface.points)), np.array([np.inf, np.inf])
    if checker is not None:
        usable = usable[checker.vertex_mask(surface.points, surface.normals)]
        limits[0] = checker.pair_limit_m
    if tolerance_m is not None:
        taken = float(np.linalg.norm(grasp.points.mean(axis=0) - surface.centroid))
        limits[1] = max(tolerance_m, taken * PROGRESS)
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    return lay_out(
        surface.points, -surface.normals, surface.centroid, quality, length_m, usable,
        len(grasp.vertices), limits,
    )  # fmt: skip


def _to_the_top(
    climber: Climber, neighbours: "_Neighbours", place: Place, layout: Layout, parameters: RefineParameters
) -> Place:
    """Climb to a summit, and from summit to summit until jumps find no higher one."""
    random = np.random.default_rng(parameters.seed)
    here = climber.climb(place, neighbours)
    failed = 0
    while failed < parameters.jumps:
        drawn = _some_pairs(here.leaves, layout.in_order, parameters.draws, random)
        landed = climber.best(drawn, here.value * parameters.jump_down, here)
        top = None if landed is None else climber.climb(landed, neighbours)
        failed += 1
        if top is not None and top.value > here.value * PROGRESS:
            here, failed = top, 0
    return here


class _Neighbours:
    """Grasps with one contact anywhere, then those with two on their contours."""

    def __init__(self, layout: Layout, network: SurfaceNetwork) -> None:
        self._layout, self._network = layout, network

    def __call__(self, leaves: IntArray) -> Iterator[IntArray]:
        yield self._one_anywhere(leaves)
        yield self._two_on_contours(leaves)

    def _one_anywhere(self, leaves: IntArray) -> IntArray:
        in_order = self._layout.in_order
        moved = np.tile(leaves, (len(leaves), len(in_order), 1))
        for i in range(len(leaves)):
            moved[i, :, i] = in_order
        return moved.reshape(-1, len(leaves))

    def _two_on_contours(self, leaves: IntArray) -> IntArray:
        contours = [self._contour(int(leaf)) for leaf in leaves]
        moved = []
        for i, j in combinations(range(len(leaves)), 2):
            first, second = np.meshgrid(contours[i], contours[j], indexing="ij")
            grasps = np.tile(leaves, (first.size, 1))
            grasps[:, i], grasps[:, j] = first.ravel(), second.ravel()
            moved.append(grasps)
        return np.concatenate(moved)

    def _contour(self, leaf: int) -> IntArray:
        """Return the leaves of the usable nodes on the contour around a leaf."""
        leaves = self._layout.leaf_of[self._network.contour(int(self._layout.nodes[leaf]))]
        return np.asarray(leaves[leaves >= 0])


def _some_pairs(leaves: IntArray, among: IntArray, count: int, random: np.random.Generator) -> IntArray:
    """Return grasps with two random contacts each moved to random leaves, shape (count, n_f)."""
    grasps = np.tile(leaves, (count, 1))
    pairs = list(combinations(range(len(leaves)), 2))
    chosen = np.array(pairs)[random.integers(len(pairs), size=count)]
    grasps[np.arange(count)[:, None], chosen] = among[random.integers(len(among), size=(count, 2))]
    return grasps
