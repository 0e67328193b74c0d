"""One measure of many grasps at a time, evaluated only as far as needed."""

from collections.abc import Callable

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.grasp.epsilon import smallest_support
from graspbench.grasp.quality import QualityParameters, singular_measures
from graspbench.grasp.wrench import grasp_matrix, wrench_maps
from graspbench.planning.merit import support_bounds
from graspbench.reconstruction.surface import Surface

MEASURES = ("q1", "q2", "q3")
_COARSE = (24, 96)  # directions that leave out most grasps before all directions are looked at
_BATCH = 32


class Measure:
    """One of Q1, Q2, Q3 on a surface, for many grasps at a time.

    Args:
        name: "q1", "q2" or "q3".
        surface: The surface.
        quality: How contacts and wrenches are modelled.

    Raises:
        ConfigurationError: There is no such measure.
    """

    def __init__(self, name: str, surface: Surface, quality: QualityParameters) -> None:
        if name not in MEASURES:
            raise ConfigurationError(
                f"unknown measure '{name}'", remedy=f"choose from {', '.join(MEASURES)}", name=name
            )
        self.name, self.surface, self.quality = name, surface, quality
        self.torque_length_m = quality.torque_length_m(surface.points, surface.centroid)

    def bounds(self, vertices: IntArray, *, tight: bool = True) -> FloatArray:
        """Return upper bounds, shape (n,), for vertices of shape (n, n_f); exact for Q1 and Q2."""
        maps = self._maps(vertices)
        if self.name == "q3":
            return support_bounds(maps, self.quality, tight=tight)
        return singular_measures(grasp_matrix(maps))[0 if self.name == "q1" else 1]

    def best(
        self, vertices: IntArray, floor: float, accept: Callable[[IntArray], bool]
    ) -> tuple[IntArray, float] | None:
        """Return the best grasp above a floor that is accepted, and its measure; None if there is none.

        Args:
            vertices: The grasps to look at, shape (n, n_f).
            floor: Grasps whose measure is not larger do not count.
            accept: Asked only of grasps better than all that were accepted before.
        """
        if self.name == "q3":
            for directions in _COARSE:
                maps = self._maps(vertices)
                bounds = support_bounds(maps, self.quality, directions=directions, tight=False)
                vertices = vertices[bounds > floor]
        bounds = self.bounds(vertices, tight=False)
        order = np.argsort(-bounds, kind="stable")
        found: tuple[IntArray, float] | None = None
        for first in range(0, len(order), _BATCH):
            some = order[first : first + _BATCH]
            some = some[bounds[some] > floor]
            if not len(some):
                break
            values = self.values(vertices[some], floor)
            for k in np.argsort(-values, kind="stable"):
                if values[k] <= floor:
                    break
                if accept(vertices[some[k]]):
                    found = vertices[some[k]], float(values[k])
                    floor = found[1]
                    break
        return found

    def value(self, vertices: IntArray, floor: float = 0.0) -> float:
        """Return the measure of one grasp, shape (n_f,); exact when it is larger than ``floor``."""
        return float(self.values(vertices[None], floor)[0])

    def values(self, vertices: IntArray, floor: float = 0.0) -> FloatArray:
        """Return the measure of grasps of shape (n, n_f); exact where it is larger than ``floor``."""
        if self.name != "q3":
            return self.bounds(vertices)
        polytope = self.quality.polytope()
        wrenches = polytope.vertices @ np.swapaxes(self._maps(vertices), -1, -2)
        found = smallest_support(wrenches, polytope, minkowski=self.quality.norm == "linf", stop_at=floor)
        return np.maximum(found, 0.0)

    def _maps(self, vertices: IntArray) -> FloatArray:
        return wrench_maps(
            self.surface.points[vertices],
            -self.surface.normals[vertices],
            self.surface.centroid,
            contact=self.quality.contact,
            wrench_space=self.quality.wrench_space,
            torque_length=self.torque_length_m,
        )
