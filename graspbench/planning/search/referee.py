"""Who may hold a grasp: the hand, asked about one grasp at a time.

The hand's solver is numerical: what it holds is held, but what it does not find may still be there. So the
referee remembers what was refused, and tells what is proved to be out of the hand's reach from what is not.
"""

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from graspbench.arrays import IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.checker import HeldContacts
from graspbench.hand.posture import HandPosture
from graspbench.planning.constraint import GraspConstraint
from graspbench.reconstruction.surface import Surface

NEIGHBOURS, PATIENT_NEIGHBOURS = 3, 12
"""Grasps that are held and from which the hand is moved to one that it refused."""


@dataclass(frozen=True)
class Verdict:
    """What came of the grasps that the hand refused.

    Attributes:
        grasp: The best of them that it can hold after all; None if there is none.
        value: Its value; -inf if there is none.
        doubtful: Values of those that are better than it and neither held nor excluded, the largest first.
    """

    grasp: Grasp | None
    value: float
    doubtful: tuple[float, ...]


class Referee:
    """Asks the hand, and remembers what it said.

    Args:
        surface: The surface.
        checker: The hand; None holds everything.
        known: Grasps on the surface that the hand holds.
    """

    def __init__(
        self, surface: Surface, checker: GraspConstraint | None, known: tuple[Grasp, ...] = ()
    ) -> None:
        self._surface = surface
        self._checker = checker
        self._held: dict[tuple[int, ...], Grasp] = {}
        self._refused: dict[tuple[int, ...], IntArray] = {}
        self.placements = 0
        for grasp in known:
            if checker is None or grasp.posture is not None:
                self._held[_key(grasp.vertices)] = grasp

    def hold(self, nodes: IntArray, start: HandPosture | None = None) -> Grasp | None:
        """Return the grasp with contacts on nodes, shape (n_f,), if the hand can hold it; else None.

        Args:
            nodes: Where the fingers touch.
            start: A posture for similar contacts in the same order, from which the hand is tried first.
        """
        if self._checker is None:
            return self._grasp(nodes, None)
        key = _key(nodes)
        if key in self._held:
            return self._held[key]
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        self.placements += 1
        posture = None
        if key not in self._refused or start is not None:
            posture = self._checker.place(points, normals, start=start)
        if posture is None:
            near = self._near(nodes, NEIGHBOURS)
            posture = self._checker.place_patiently(points, normals, near, anywhere=False)
        if posture is None:
            self._refused[key] = nodes
            return None
        self._refused.pop(key, None)
        self._held[key] = self._grasp(nodes, posture)
        return self._held[key]

    def settle(
        self, best: float, evaluate: Callable[[IntArray], float], out_of_time: Callable[[], bool]
    ) -> Verdict:
        """Look again, longer, at all refused grasps that would be better than the best one.

        Args:
            best: Value of the best grasp that is held.
            evaluate: Returns the value of a grasp (nodes, shape (n_f,)); -inf if it is none.
            out_of_time: Asked before each of them.
        """
        doubtful: list[float] = []
        for value, nodes in self._better(best, evaluate):
            points, normals = self._surface.points[nodes], self._surface.normals[nodes]
            assert self._checker is not None, "only a hand refuses"
            if self._checker.excludes(points, normals):
                continue
            if not out_of_time():
                self.placements += 1
                near = self._near(nodes, PATIENT_NEIGHBOURS)
                posture = self._checker.place_patiently(points, normals, near)
                if posture is not None:
                    return Verdict(self._grasp(nodes, posture), value, tuple(doubtful))
            doubtful.append(value)
        return Verdict(None, -np.inf, tuple(doubtful))

    def _better(self, best: float, evaluate: Callable[[IntArray], float]) -> Iterator[tuple[float, IntArray]]:
        """Yield what was refused and is better than ``best``, the best first."""
        valued = [(evaluate(nodes), nodes) for nodes in self._refused.values()]
        better = [(value, nodes) for value, nodes in valued if value > best]
        yield from sorted(better, key=lambda pair: (-pair[0], _key(pair[1])))

    def _near(self, nodes: IntArray, count: int) -> list[HeldContacts]:
        """Return the held grasps nearest to nodes, their contacts in the same order."""
        points, found = self._surface.points, []
        for grasp in self._held.values():
            gaps = np.linalg.norm(points[nodes][:, None] - grasp.points[None], axis=2)
            rows, columns = linear_sum_assignment(gaps)
            found.append((float(gaps[rows, columns].max()), columns, grasp))
        found.sort(key=lambda entry: entry[0])
        near = []
        for _, order, grasp in found[:count]:
            assert grasp.posture is not None, "a hand holds it"
            fingers = tuple(grasp.posture.fingers[k] for k in order)
            posture = dataclasses.replace(grasp.posture, fingers=fingers)
            near.append(HeldContacts(grasp.points[order], grasp.normals[order], posture))
        return near

    def _grasp(self, nodes: IntArray, posture: HandPosture | None) -> Grasp:
        surface = self._surface
        return Grasp(nodes, surface.points[nodes], surface.normals[nodes], surface.centroid, posture)


def _key(nodes: IntArray) -> tuple[int, ...]:
    return tuple(sorted(int(node) for node in nodes))
