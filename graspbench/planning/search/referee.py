"""Who may hold a grasp: the hand, asked about one grasp at a time."""

from graspbench.arrays import IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.posture import HandPosture
from graspbench.planning.constraint import GraspConstraint
from graspbench.reconstruction.surface import Surface


class Referee:
    """Asks the hand, and counts how often.

    Args:
        surface: The surface.
        checker: The hand; None holds everything.
    """

    def __init__(self, surface: Surface, checker: GraspConstraint | None) -> None:
        self._surface = surface
        self._checker = checker
        self.placements = 0

    def hold(self, nodes: IntArray, start: HandPosture | None = None) -> Grasp | None:
        """Return the grasp with contacts on nodes, shape (n_f,), if the hand can hold it; else None.

        Args:
            nodes: Where the fingers touch.
            start: A posture for similar contacts, from which the hand is tried first.
        """
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        posture = None
        if self._checker is not None:
            self.placements += 1
            posture = self._checker.place(points, normals, start=start)
            if posture is None:
                return None
        return Grasp(nodes, points, normals, self._surface.centroid, posture)
