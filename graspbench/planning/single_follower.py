"""The thesis' planner: one grasp that follows the surface, the hand in every move (thesis 3.4)."""

from collections.abc import Iterator

import numpy as np

from graspbench.errors import PlanningError
from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.judge import Candidate, Judge
from graspbench.planning.progress import PlanningStep, step_of
from graspbench.planning.settling import Follower, arrive, settle
from graspbench.reconstruction.surface import Surface

MAX_FIRST_TRIES = 24
"""First grasps that the hand tries at most before one leads that it cannot hold yet."""


class SingleFollower:
    """One grasp on its way.

    Args:
        judge: Index and hand.
        n_f: Number of contacts.
    """

    def __init__(self, judge: Judge, n_f: int) -> None:
        self._judge, self._n_f = judge, n_f
        self._planes: Iterator[tuple[InitialGrasp, ...]] = iter(())
        self._seen: list[tuple[InitialGrasp, ...]] = []
        self._surfaces: list[Surface] = []
        self._lead = Follower(np.empty(0, dtype=np.int64))
        self._initial: InitialGrasp | None = None
        self._feasible = False
        self.steps: list[PlanningStep] = []
        self.moves = self.evaluations = 0  # the judge counts them

    def follow(self, surface: Surface) -> None:
        """Move the grasp on the next surface until no finger wants to move."""
        self._surfaces.append(surface)
        if self._initial is None:
            self._start(surface)
        arrive(self._lead, surface)
        self._lead.followed = self._lead.vertices
        self._judge.see(surface)
        self._feasible = settle(self._lead, surface, self._judge.settler)
        score = self._judge.index.score(surface, self._lead.vertices)
        self.steps.append(step_of(surface, self._lead.vertices, score, 1))

    def choose(self) -> list[Candidate]:
        """Return the grasp that it has become, if it is one.

        When it is none, further first grasps go straight to the last surface, with
        ``planner.select=first``.
        """
        assert self._initial is not None
        surface = self._surfaces[-1]
        found: list[Candidate] = []
        self._judge.judge(self._lead, self._initial, surface, self._feasible, found)
        if self._judge.planner.select == "first":
            for plane in self._every_plane():
                for initial in plane:
                    if not found and initial is not self._initial:
                        follower = Follower(initial.vertices, evaluations=1)
                        follower.via.append((self._surfaces[0], initial.vertices))
                        self._judge.settle(follower, initial, surface, found)
        return found

    def _every_plane(self) -> Iterator[tuple[InitialGrasp, ...]]:
        """Yield the first grasps of every plane, those of the leading grasp's plane first."""
        yield from (plane for plane in self._seen if self._initial in plane)
        yield from (plane for plane in self._seen if self._initial not in plane)
        yield from self._planes

    def _start(self, surface: Surface) -> None:
        """Choose the first grasp: in the best plane where the hand holds one, else in the best plane."""
        self._planes = initial_grasps(surface, self._n_f, self._judge.planner.rotations)
        allowed, tries = self._judge.allowed(surface), 0
        for plane in self._planes:
            self._seen.append(plane)
            for grasp in plane:
                if tries == MAX_FIRST_TRIES or not np.all(allowed[grasp.vertices]):
                    continue
                if self._judge.held(surface, grasp.vertices)[0]:
                    return self._lead_with(grasp)
                tries += 1
        options = [grasp for plane in self._seen for grasp in plane]
        if not options:
            raise PlanningError(
                f"the surface has too few nodes for {self._n_f} contacts", remedy="raise surface.nodes"
            )
        self._lead_with(options[0])

    def _lead_with(self, grasp: InitialGrasp) -> None:
        self._initial = grasp
        self._lead = Follower(grasp.vertices)
