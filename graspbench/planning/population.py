"""Many grasps that follow the surface at the same time (beyond the thesis' single one).

All first grasps of all planes move on every surface, by the index alone: the ground and the fingertip's own
size say where contacts may be, the hand's span which grasps come first. Grasps that meet become one, and as
the surface tightens the worse ones are given up, so that there is a best grasp at every step. When the
surface is at rest, what has followed is polished, and the hand takes the best one that it can hold.
"""

import numpy as np

from graspbench.arrays import BoolArray, IntArray
from graspbench.errors import PlanningError
from graspbench.planning.index import ClimbingIndex
from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.judge import Candidate, Judge
from graspbench.planning.progress import PlanningStep, step_of
from graspbench.planning.screen import climb_freely, nearest_allowed
from graspbench.planning.settling import Follower, arrive
from graspbench.reconstruction.carrying import mean_distance
from graspbench.reconstruction.surface import Surface

MAX_TRIES = 60
"""Grasps that are let settle with the hand at most, when the hand holds none of the best at once."""

SLOW_STARTS = 8
"""First grasps for an index that does not climb by itself, one in each of the first planes."""

_TIGHT = 0.02
"""The surface is tightening once its nodes move less than this share of its size from one to the next."""


class Population:
    """The grasps under way.

    Args:
        judge: Index and hand.
        n_f: Number of contacts.
    """

    def __init__(self, judge: Judge, n_f: int) -> None:
        self._judge, self._n_f = judge, n_f
        self._members: list[tuple[InitialGrasp, Follower]] = []
        self._before: Surface | None = None
        self._surface: Surface | None = None
        self._given_up: list[Follower] = []
        self._started = 0
        self.steps: list[PlanningStep] = []

    @property
    def moves(self) -> int:
        """Moves of all grasps that the judge does not count, those given up included."""
        return sum(follower.moves for follower in self._not_judged())

    @property
    def evaluations(self) -> int:
        """Proposals asked from the index for these."""
        return sum(follower.evaluations for follower in self._not_judged())

    def follow(self, surface: Surface) -> None:
        """Move all grasps on the next surface; leave out those that met another or fell behind."""
        if self._surface is None:
            self._start(surface)
        self._before, self._surface = self._surface, surface
        self._judge.see(surface)
        allowed = self._judge.allowed(surface)
        nearest = nearest_allowed(surface, allowed)
        met: dict[tuple[int, ...], tuple[InitialGrasp, Follower]] = {}
        for initial, follower in self._members:
            arrive(follower, surface)
            follower.followed = follower.vertices
            vertices = nearest[follower.vertices]
            if len(set(vertices.tolist())) == len(vertices):
                self._climb(follower, surface, vertices, allowed, thorough=False)
                if surface.at_rest:
                    follower.rough = follower.vertices
                    self._climb(follower, surface, follower.vertices, allowed, thorough=True)
                key = tuple(sorted(follower.vertices.tolist()))
                if met.setdefault(key, (initial, follower))[1] is follower:
                    continue
            self._given_up.append(follower)
        self._members = list(met.values())
        self._rank(surface)

    def choose(self) -> Candidate | None:
        """Return the best grasp that the hand can hold; None if it holds none."""
        surface, judge = self._surface, self._judge
        assert surface is not None
        found: list[Candidate] = []
        optima = [follower.vertices for _, follower in self._members]
        order = list(judge.ranked(surface, optima))
        for rank, promise in order:
            if not judge.robust and found and max(candidate.merit for candidate in found) >= promise:
                break  # what is left promises less than what the hand can hold already
            if len(found) == judge.wanted:
                break
            initial, follower = self._members[rank]
            if judge.spans(surface, follower.vertices) and judge.holds(surface, follower.vertices):
                judge.settle(follower, initial, surface, found)
        if not found:
            self._settle_anyhow(surface, [rank for rank, _ in order], found)
        judge.tried = self._started
        return max(found, key=lambda candidate: candidate.merit) if found else None

    def _settle_anyhow(self, surface: Surface, order: list[int], found: list[Candidate]) -> None:
        """Let the hand lead grasps that it cannot hold as they are to some that it can."""
        for tries, rank in enumerate(order):
            initial, follower = self._members[rank]
            for vertices in (follower.vertices, follower.rough):
                if found or tries > MAX_TRIES or vertices is None:
                    break
                again = Follower(vertices, via=list(follower.via), followed=follower.followed)
                self._judge.settle(again, initial, surface, found)

    def _start(self, surface: Surface) -> None:
        planner = self._judge.planner
        slow = not isinstance(self._judge.index, ClimbingIndex)
        rotations, planes = (
            (1, min(SLOW_STARTS, planner.planes)) if slow else (planner.rotations, planner.planes)
        )
        for count, plane in enumerate(initial_grasps(surface, self._n_f, rotations)):
            if count < planes:
                for initial in plane:
                    via = [(surface, initial.vertices)]
                    self._members.append((initial, Follower(initial.vertices, via=via)))
        self._started = len(self._members)
        if not self._members:
            raise PlanningError(
                f"the surface has too few nodes for {self._n_f} contacts", remedy="raise surface.nodes"
            )

    def _climb(
        self,
        follower: Follower,
        surface: Surface,
        vertices: IntArray,
        allowed: BoolArray,
        *,
        thorough: bool,
    ) -> None:
        path = climb_freely(
            self._judge.index,
            surface,
            vertices,
            allowed,
            thorough=thorough,
            max_moves=self._judge.planner.max_moves,
        )
        follower.via.extend((surface, step) for step in path)
        follower.vertices = path[-1]
        follower.moves += len(path) - 1
        follower.evaluations += len(path)

    def _rank(self, surface: Surface) -> None:
        """Put the best first, what the hand spans before what it does not; give up those behind."""
        scores = [self._judge.index.score(surface, follower.vertices) for _, follower in self._members]
        wide = [not self._judge.spans(surface, follower.vertices) for _, follower in self._members]
        order = sorted(range(len(scores)), key=lambda i: (wide[i], -scores[i]))
        kept = self._places(surface)
        self._given_up += [self._members[i][1] for i in order[kept:]]
        self._members = [self._members[i] for i in order[:kept]]
        if order:
            best = self._members[0][1].vertices
            self.steps.append(step_of(surface, best, scores[order[0]], len(self._members)))

    def _places(self, surface: Surface) -> int:
        """Return how many grasps go on: half of those too many for each surface that hardly moves."""
        alive, most = len(self._members), self._judge.planner.followers
        if alive <= most or self._before is None:
            return alive
        moved = mean_distance(self._before, surface)
        size = np.linalg.norm(surface.points - surface.centroid, axis=1).mean()
        if surface.at_rest:
            return most
        return most + (alive - most) // 2 if moved < _TIGHT * size else alive

    def _not_judged(self) -> list[Follower]:
        judged = {id(follower) for follower in self._judge.followers}
        everyone = [*self._given_up, *(follower for _, follower in self._members)]
        return [follower for follower in everyone if id(follower) not in judged]
