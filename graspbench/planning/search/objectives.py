"""What is searched for: an upper bound for clusters, and the value of one grasp."""

from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.planning.search.bounds import Q1, Q2, Q3, bound_tuples, largest_balls
from graspbench.planning.search.covering import standing_grasps
from graspbench.planning.search.layout import Layout, single_grasps

FEW = 4096
"""Grasps that are looked at together for Q3."""

_CODES = {"q1": Q1, "q2": Q2, "q3": Q3}


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

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """See `Objective`."""
        layout = self._layout
        bound_tuples(
            tuples, bounds, layout.branches, layout.balls, layout.table, layout.maps.shape[1], layout.grams,
            _CODES[self._measure], self._minkowski, self._limits, lower,
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
        return self._layout.measure(tuples, self._measure, lower)


class PlanarObjective:
    """Q1, Q2 or Q3 in a planar wrench space, which depends on each grasp's plane.

    The only bounds that hold for all planes are those of the trace of G G^T and of the longest wrench, so
    that this search is little better than enumeration.

    Args:
        layout: The problem.
        measure: ``q1``, ``q2`` or ``q3``.
    """

    few = 1

    def __init__(self, layout: Layout, measure: str) -> None:
        self._layout = layout
        self._measure = measure
        self._limits = layout.limits / layout.torque_length
        traces = np.sum(layout.maps**2, axis=(1, 2))
        lengths = np.linalg.norm(layout.wrenches, axis=2).max(axis=1)
        span = layout.tree.span
        self._trace = np.array([traces[a:b].max() for a, b in span])
        self._length = np.array([lengths[a:b].max() for a, b in span])

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """See `Objective`."""
        size = 3 if self._layout.quality.wrench_space == "planar" else 2
        mean = self._trace[tuples].sum(axis=1) / size
        if self._measure == "q1":
            values = np.sqrt(mean)
        elif self._measure == "q2":
            values = mean ** (0.5 * size)
        else:
            sums = self._layout.quality.norm == "linf"
            values = self._length[tuples].sum(axis=1) if sums else self._length[tuples].max(axis=1)
        np.minimum(bounds, values * (1.0 + 1e-9), out=bounds)
        bounds[~self._within_limits(tuples)] = -np.inf

    def candidates(self, tuples: IntArray, lower: float) -> tuple[IntArray, FloatArray]:
        """See `Objective`."""
        return single_grasps(self._layout, tuples)

    def promise(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        if self._measure != "q3":
            return self._layout.singular(tuples, self._measure)
        return np.asarray(self._length[self._layout.tree.leaves[tuples]].sum(axis=1))

    def evaluate(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        return self._layout.measure(tuples, self._measure, lower)

    def _within_limits(self, tuples: IntArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        centres, radii = self._layout.balls[tuples, :3], self._layout.balls[tuples, 3]
        gaps = np.linalg.norm(centres[:, :, None] - centres[:, None, :], axis=-1)
        gaps -= radii[:, :, None] + radii[:, None, :]
        away = np.linalg.norm(centres.mean(axis=1), axis=1) - radii.mean(axis=1)
        return np.asarray((gaps.max(axis=(1, 2)) <= self._limits[0]) & (away <= self._limits[1]))


def make_objective(layout: Layout, measure: str) -> Objective:
    """Return the objective of ``q1``, ``q2`` or ``q3``."""
    if layout.planar:
        return PlanarObjective(layout, measure)
    return WrenchObjective(layout, measure)
