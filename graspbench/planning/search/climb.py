"""Climbing a measure: from a grasp to the best of its neighbours, until none is better."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.posture import HandPosture
from graspbench.planning.search.layout import Layout
from graspbench.planning.search.objectives import Objective
from graspbench.planning.search.referee import Referee

SAMPLES = 8192
AT_ONCE, MAX_MEASURED = 8, 256
"""Grasps of which the best is tried first, and grasps that are measured together while none is found."""

PROGRESS = 1.0 + 1e-9
"""A grasp is better by more than this factor: less than rounding is no progress."""

Neighbours = Callable[[IntArray], Iterator[IntArray]]
"""Yields batches of grasps, shape (m, n_f), near a grasp; the first batch with a better one is taken."""


@dataclass(frozen=True)
class Place:
    """A grasp on the way.

    Attributes:
        leaves: Its contacts, shape (n_f,).
        value: Its measure; -inf where it is no grasp that the hand holds.
        grasp: The grasp; None where there is none.
        steps: Moves that led to it.
    """

    leaves: IntArray
    value: float
    grasp: Grasp | None
    steps: int = 0


class Climber:
    """Climbs one measure over grasps that are force closure and that the hand holds.

    Args:
        layout: The problem.
        objective: What is to be maximised.
        referee: Who may hold a grasp.
        follow: Whether the hand is tried first in the posture of the grasp that is climbed from.
    """

    def __init__(self, layout: Layout, objective: Objective, referee: Referee, *, follow: bool) -> None:
        self._layout, self._objective, self._referee, self._follow = layout, objective, referee, follow
        self.looked_at = 0

    def climb(
        self, place: Place, neighbours: Neighbours, out_of_time: Callable[[], bool] = lambda: False
    ) -> Place:
        """Move to the best of the neighbours again and again, until none is better or the time is up."""
        while True:
            for grasps in neighbours(place.leaves):
                if out_of_time():
                    return place
                better = self.best(grasps, place.value, place)
                if better is not None:
                    break
            else:
                return place
            place = better

    def best(self, grasps: IntArray, floor: float, origin: Place) -> Place | None:
        """Return the best of many grasps that is better than ``floor``; None if there is none.

        Args:
            grasps: Shape (m, n_f); which do not meet the limits are left out.
            floor: Grasps whose measure is not larger do not count.
            origin: Where the way to them goes on from.
        """
        grasps = grasps[self._layout.within_limits(grasps)]
        self.looked_at += len(grasps)
        floor = floor * PROGRESS if floor > 0.0 else floor
        promise = self._objective.promise(grasps, floor)
        order = np.argsort(-promise, kind="stable")
        posture = origin.grasp.posture if self._follow and origin.grasp is not None else None
        found: Place | None = None
        order = order[promise[order] > floor]
        first, count = 0, AT_ONCE
        while first < len(order) and promise[order[first]] > floor:
            some = grasps[order[first : first + count]]
            values = self._objective.evaluate(some, floor)
            first, count = first + count, min(2 * count, MAX_MEASURED)
            for begin in np.unique(np.flatnonzero(values > floor) // AT_ONCE) * AT_ONCE:
                part = slice(begin, begin + AT_ONCE)
                better = self._best_held(some[part], values[part], floor, posture)
                if better is not None:
                    found = replace(better, steps=origin.steps + 1)
                    floor, count = found.value, AT_ONCE
        return found

    def _best_held(
        self, grasps: IntArray, values: FloatArray, floor: float, posture: HandPosture | None
    ) -> Place | None:
        """Return the best of a few grasps above a floor that the hand holds."""
        for k in np.argsort(-values, kind="stable"):
            if not values[k] > floor:
                break
            grasp = self._referee.hold(self._layout.nodes[grasps[k]], posture)
            if grasp is not None:
                return Place(grasps[k], float(values[k]), grasp)
        return None


class ContactsInTurn:
    """Neighbours with one contact anywhere on the surface, one contact after the other.

    Args:
        count: Number of nodes.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._contact = 0

    def __call__(self, leaves: IntArray) -> Iterator[IntArray]:
        """Yield the grasps with the next contact moved, then with the one after it, and so on."""
        for _ in range(len(leaves)):
            contact = self._contact % len(leaves)
            self._contact = contact + 1
            moved = np.repeat(leaves[None], self._count, axis=0)
            moved[:, contact] = np.arange(self._count)
            yield moved


def sampled_grasps(layout: Layout, objective: Objective, count: int) -> list[IntArray]:
    """Return the most promising of some random grasps, best first.

    Args:
        layout: The problem.
        objective: What is to be maximised.
        count: Number of grasps wanted, each force closure; fewer where fewer were found.

    Returns:
        Leaves of each, shape (n_f,).
    """
    samples = layout.sample(SAMPLES)
    order = np.argsort(-objective.promise(samples, -np.inf), kind="stable")
    found: list[IntArray] = []
    for start in range(0, len(order), AT_ONCE):
        if len(found) >= count:
            break
        part = samples[order[start : start + AT_ONCE]]
        found += list(part[objective.evaluate(part, -np.inf) > -np.inf])
    return found[:count]
