"""Where many grasps have been: kept surface by surface, read for one grasp when it is asked for."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import IntArray
from graspbench.planning.index import Climbs
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class _Leg:
    """What some grasps did on one surface."""

    surface: Surface
    names: IntArray
    climbs: Climbs


class Trails:
    """The configurations of grasps that each have a number as a name."""

    def __init__(self) -> None:
        self._legs: list[_Leg] = []
        self._forks: dict[int, tuple[int, int]] = {}
        self.moves = 0
        self.evaluations = 0

    def stand(self, surface: Surface, names: IntArray, grasps: IntArray) -> None:
        """Note where grasps are on a surface without having moved.

        Args:
            surface: The surface.
            names: Who they are, shape (m,).
            grasps: Their vertices, shape (m, n_f).
        """
        self._legs.append(_Leg(surface, names, Climbs(grasps, np.arange(len(names) + 1))))

    def climb(self, surface: Surface, names: IntArray, climbs: Climbs) -> None:
        """Note how grasps moved on a surface.

        Args:
            surface: The surface.
            names: Who they are, shape (m,).
            climbs: The way of each.
        """
        self._legs.append(_Leg(surface, names, climbs))
        self.evaluations += len(climbs.paths)
        self.moves += len(climbs.paths) - len(names)

    def fork(self, names: IntArray, others: IntArray, legs: int) -> None:
        """Let grasps have the beginning of their way in common with others.

        Args:
            names: Who they are, shape (m,).
            others: With whom, shape (m,).
            legs: How many notes of the others count; see ``legs``.
        """
        self._forks.update((int(name), (int(other), legs)) for name, other in zip(names, others, strict=True))

    @property
    def legs(self) -> int:
        """How often grasps were noted so far."""
        return len(self._legs)

    def of(self, name: int) -> list[tuple[Surface, IntArray]]:
        """Return a grasp's configurations, first to last: surface and vertices of shape (n_f,)."""
        other, legs = self._forks.get(name, (name, 0))
        via: list[tuple[Surface, IntArray]] = []
        for number, leg in enumerate(self._legs):
            for rank in np.flatnonzero(leg.names == (other if number < legs else name)):
                via.extend((leg.surface, vertices) for vertices in leg.climbs.path(int(rank)))
        return via
