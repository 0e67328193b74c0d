"""What is searched for: an upper bound for clusters, and the value of one grasp."""

from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.planning.search.bounds import Q1, Q2, Q3, bound_tuples, largest_balls
from graspbench.planning.search.covering import standing_grasps
from graspbench.planning.search.layout import Layout, single_grasps
from graspbench.planning.search.planar import bound_planar, planar_grasps, planar_promise
from graspbench.planning.search.refuting import WeakDirections
from graspbench.planning.search.tables import even_directions

FEW = 4096
"""Grasps that are looked at together for Q3."""

FEW_PLANAR, LISTED = 64, 4096
"""Grasps of one tuple, and of several, that are looked at together in a planar wrench space."""

PLANAR_DIRECTIONS = {2: 24, 3: 96}
"""Even directions of a planar wrench space, by its components."""

CODES = {"q1": Q1, "q2": Q2, "q3": Q3}
"""Measures in compiled code."""


class Objective(Protocol):
    """A measure that is to be maximised over force closure grasps.

    Attributes:
        few: Tuples of clusters that hold at most this many grasps are not split any more.
    """

    few: int

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """Lower the bounds of tuples of clusters, shape (m,), in place; to -inf where there is no grasp.

        Bounds at or below ``lower`` need not be exact.
        """
        ...

    def candidates(self, tuples: IntArray, lower: float) -> tuple[IntArray, FloatArray]:
        """List the grasps of tuples of clusters that may be better than ``lower``, and their upper bounds."""
        ...

    def promise(self, tuples: IntArray, lower: float) -> FloatArray:
        """Return cheap upper bounds of the values of grasps (tuples of leaf numbers), shape (m,).

        Bounds at or below ``lower`` need not be exact.
        """
        ...

    def evaluate(self, tuples: IntArray, lower: float) -> FloatArray:
        """Return the values of grasps (tuples of leaf numbers), shape (m,); -inf where one is none."""
        ...


class WrenchObjective:
    """Q1, Q2 or Q3 in a spatial wrench space.

    Args:
        layout: The problem.
        measure: ``q1``, ``q2`` or ``q3``.
    """

    def __init__(self, layout: Layout, measure: str) -> None:
        self._layout = layout
        self._measure = measure
        self._minkowski = measure == "q3" and layout.quality.norm == "linf"
        self._limits = layout.limits / layout.torque_length
        self._covered = measure == "q3" and not self._minkowski
        self.few = FEW if self._covered else 1
        self._weak = WeakDirections(layout.wrenches) if self._covered else None

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """See `Objective`."""
        layout = self._layout
        bound_tuples(
            tuples, bounds, layout.branches, layout.balls, layout.table, layout.maps.shape[1], layout.grams,
            CODES[self._measure], self._minkowski, self._limits, lower,
        )  # fmt: skip

    def candidates(self, tuples: IntArray, lower: float) -> tuple[IntArray, FloatArray]:
        """See `Objective`."""
        if not self._covered:
            return single_grasps(self._layout, tuples)
        layout, floor = self._layout, max(lower, 0.0)
        grasps, bounds = np.empty((FEW, tuples.shape[1]), dtype=np.int64), np.empty(FEW)
        found = []
        while len(tuples):
            done, listed = standing_grasps(
                tuples, layout.branches, layout.wrenches, layout.table, layout.directions,
                floor, grasps, bounds,
            )  # fmt: skip
            found.append((grasps[:listed].copy(), bounds[:listed].copy()))
            tuples = tuples[done:]
        standing, reached = (np.concatenate(parts) for parts in zip(*found, strict=True))
        allowed = layout.within_limits(standing)
        return standing[allowed], np.minimum(reached, self.promise(standing, floor))[allowed]

    def promise(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        layout = self._layout
        if self._measure != "q3":
            return layout.singular(tuples, self._measure)
        return largest_balls(layout.tree.leaves[tuples], layout.table, self._minkowski, lower)

    def evaluate(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        if self._weak is None or lower <= 0.0:
            return self._layout.measure(tuples, self._measure, lower)
        values, standing = np.full(len(tuples), -np.inf), ~self._weak.refuted(tuples, lower)
        values[standing] = self._layout.measure(tuples[standing], self._measure, lower)
        return values


class PlanarObjective:
    """Q1, Q2 or Q3 in a planar wrench space, which depends on each grasp's plane.

    Args:
        layout: The problem.
        measure: ``q1``, ``q2`` or ``q3``.
    """

    few = FEW_PLANAR

    def __init__(self, layout: Layout, measure: str) -> None:
        self._layout, self._measure, self._code = layout, measure, CODES[measure]
        self._minkowski = measure == "q3" and layout.quality.norm == "linf"
        self._limits = layout.limits / layout.torque_length
        self._arms = (layout.points - layout.centroid) / layout.torque_length
        self._normals = np.ascontiguousarray(layout.normals_in)
        self._vertices = np.ascontiguousarray(layout.polytope.vertices)
        size = 3 if layout.quality.wrench_space == "planar" else 2
        self._directions = even_directions(PLANAR_DIRECTIONS[size], size)
        traces = np.sum(layout.maps**2, axis=(1, 2))
        self._caps = np.array([traces[a:b].max() for a, b in layout.tree.span])
        lengths = np.linalg.norm(layout.wrenches, axis=2).max(axis=1)
        self._lengths = np.array([lengths[a:b].max() for a, b in layout.tree.span])

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """See `Objective`."""
        bound_planar(
            tuples, bounds, self._layout.branches, self._layout.balls, self._caps, self._arms, self._normals,
            self._vertices, self._directions, self._code, self._minkowski, self._limits, lower,
        )  # fmt: skip
        if self._measure == "q3":  # no ball reaches farther than the longest wrench
            lengths = self._lengths[tuples]
            longest = lengths.sum(axis=1) if self._minkowski else lengths.max(axis=1)
            np.minimum(bounds, longest * (1.0 + 1e-9), out=bounds)

    def candidates(self, tuples: IntArray, lower: float) -> tuple[IntArray, FloatArray]:
        """See `Objective`."""
        found = []
        grasps, bounds = np.empty((LISTED, tuples.shape[1]), dtype=np.int64), np.empty(LISTED)
        while len(tuples):
            done, listed = planar_grasps(
                tuples, self._layout.branches, self._arms, self._normals, self._vertices, self._directions,
                self._code, self._minkowski, lower, grasps, bounds,
            )  # fmt: skip
            found.append((grasps[:listed].copy(), bounds[:listed].copy()))
            tuples = tuples[done:]
        listed_grasps, reached = (np.concatenate(parts) for parts in zip(*found, strict=True))
        allowed = self._layout.within_limits(listed_grasps)
        return listed_grasps[allowed], reached[allowed]

    def promise(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        promised = np.empty(len(tuples))
        planar_promise(
            tuples, self._arms, self._normals, self._vertices, self._directions, self._code, self._minkowski,
            lower, promised,
        )  # fmt: skip
        return promised

    def evaluate(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        return self._layout.measure(tuples, self._measure, lower)


def make_objective(layout: Layout, measure: str) -> Objective:
    """Return the objective of ``q1``, ``q2`` or ``q3``."""
    if layout.planar:
        return PlanarObjective(layout, measure)
    return WrenchObjective(layout, measure)
