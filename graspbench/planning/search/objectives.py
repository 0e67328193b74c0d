"""What is searched for: an upper bound for clusters, and the value of one grasp."""

from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.planning.search.bounds import Q1, Q2, Q3, bound_tuples
from graspbench.planning.search.layout import Layout
from graspbench.planning.search.outer_triangle import OuterTriangleObjective

_CODES = {"q1": Q1, "q2": Q2, "q3": Q3}


class Objective(Protocol):
    """A measure that is to be maximised over force closure grasps."""

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """Lower the bounds of tuples of clusters, shape (m,), in place; to -inf where there is no grasp.

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
        limits: Largest distance of two contacts, and of their mean from the centroid, m; shape (2,).
    """

    def __init__(self, layout: Layout, measure: str, limits: FloatArray) -> None:
        self._layout = layout
        self._measure = measure
        self._minkowski = measure == "q3" and layout.quality.norm == "linf"
        self._limits = limits / layout.torque_length

    def bound(self, tuples: IntArray, bounds: FloatArray, lower: float) -> None:
        """See `Objective`."""
        layout = self._layout
        bound_tuples(
            tuples, bounds, layout.branches, layout.balls, layout.table, layout.directions, layout.grams,
            layout.wrenches, _CODES[self._measure], self._minkowski, self._limits, lower,
        )  # fmt: skip

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
        limits: Largest distance of two contacts, and of their mean from the centroid, m; shape (2,).
    """

    def __init__(self, layout: Layout, measure: str, limits: FloatArray) -> None:
        self._layout = layout
        self._measure = measure
        self._limits = limits / layout.torque_length
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

    def evaluate(self, tuples: IntArray, lower: float) -> FloatArray:
        """See `Objective`."""
        return self._layout.measure(tuples, self._measure, lower)

    def _within_limits(self, tuples: IntArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        centres, radii = self._layout.balls[tuples, :3], self._layout.balls[tuples, 3]
        gaps = np.linalg.norm(centres[:, :, None] - centres[:, None, :], axis=-1)
        gaps -= radii[:, :, None] + radii[:, None, :]
        away = np.linalg.norm(centres.mean(axis=1), axis=1) - radii.mean(axis=1)
        return np.asarray((gaps.max(axis=(1, 2)) <= self._limits[0]) & (away <= self._limits[1]))


def make_objective(
    layout: Layout, measure: str, limits: FloatArray, thresholds_deg: tuple[float, float]
) -> Objective:
    """Return the objective of a measure.

    Args:
        layout: The problem.
        measure: ``q1``, ``q2``, ``q3`` or ``mirtich_canny``.
        limits: Largest distance of two contacts, and of their mean from the centroid, m; shape (2,).
        thresholds_deg: Largest coplanarity and equilateral errors of ``mirtich_canny``, deg.
    """
    if measure == "mirtich_canny":
        return OuterTriangleObjective(layout, limits, thresholds_deg)
    if layout.planar:
        return PlanarObjective(layout, measure, limits)
    return WrenchObjective(layout, measure, limits)
