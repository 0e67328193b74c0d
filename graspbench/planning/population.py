"""Many grasps that follow the surface at the same time (beyond the thesis' single one).

All first grasps of all planes move on every surface, by the index alone: the ground and the fingertip's own
size say where contacts may be, the hand's span which grasps come first. Grasps that meet become one, and as
the surface tightens the worse ones are given up, so that there is a best grasp at every step. When the
surface is at rest, what has followed is polished, and the hand takes the best one that it can hold. Polished
is also what followers were on an early surface: later they are less different from each other.
"""

from itertools import islice
from typing import NamedTuple

import numpy as np

from graspbench.arrays import BoolArray, IntArray
from graspbench.errors import PlanningError
from graspbench.hand.posture import HandPosture
from graspbench.planning.climbing import all_different, climb_all, climbs_by_itself, moved_to_allowed, scores
from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.judge import Candidate, Judge
from graspbench.planning.progress import PlanningStep, step_of
from graspbench.planning.settling import Follower
from graspbench.planning.trails import Trails
from graspbench.reconstruction.carrying import carry_over, mean_distance
from graspbench.reconstruction.surface import Surface

MAX_TRIES = 60
"""Grasps that are let settle with the hand at most, when the hand holds none of the best at once."""

SLOW_STARTS = 8
"""First grasps for an index that does not climb by itself, one in each of the first planes."""

_EARLY = 2
"""Number of the surface on which grasps are remembered as they are, from zero."""

_TIGHT = 0.02
"""The surface is tightening once its nodes move less than this share of its size from one to the next."""


class _Early(NamedTuple):
    """Where grasps were on an early surface, and how many notes of their trails there were."""

    surface: Surface
    names: IntArray
    grasps: IntArray
    legs: int


class Population:
    """The grasps under way, each with a number as its name.

    Args:
        judge: Index and hand.
        n_f: Number of contacts.
    """

    def __init__(self, judge: Judge, n_f: int) -> None:
        self._judge, self._n_f = judge, n_f
        self._starts: list[InitialGrasp] = []  # by name
        self._started = 0
        self._names = np.empty(0, dtype=np.int64)  # of those still under way, the best first
        self._grasps = np.empty((0, n_f), dtype=np.int64)  # where they are
        self._followed = np.empty((0, n_f), dtype=np.int64)  # by name: where it was before the last surface
        self._rough = np.empty((0, n_f), dtype=np.int64)  # by name: where it was before it was polished
        self._trails = Trails()
        self._early: _Early | None = None
        self._before: Surface | None = None
        self._surface: Surface | None = None
        self.steps: list[PlanningStep] = []

    @property
    def moves(self) -> int:
        """Moves of all grasps that the judge does not count, those given up included."""
        return self._trails.moves

    @property
    def evaluations(self) -> int:
        """Proposals asked from the index for these."""
        return self._trails.evaluations

    def follow(self, surface: Surface) -> None:
        """Move all grasps on the next surface; leave out those that met another or fell behind."""
        if self._surface is None:
            self._start(surface)
        else:
            self._arrive(self._surface, surface)
        if surface.at_rest and self._early is not None:
            self._recall(self._early, surface)
        self._before, self._surface = self._surface, surface
        self._judge.see(surface)
        allowed = self._judge.allowed(surface)
        self._followed[self._names] = self._grasps
        self._grasps = moved_to_allowed(surface, self._grasps, allowed)
        self._keep(np.flatnonzero(all_different(self._grasps)))
        self._climb(surface, allowed, thorough=False)
        if surface.at_rest:
            self._rough[self._names] = self._grasps
            self._climb(surface, allowed, thorough=True)
        contacts = [tuple(grasp) for grasp in np.sort(self._grasps, axis=1).tolist()]
        first_of = {key: rank for rank, key in reversed(list(enumerate(contacts)))}
        self._keep(np.array(sorted(first_of.values()), dtype=np.int64))
        self._rank(surface)
        if len(self.steps) == _EARLY + 1:
            self._early = _Early(surface, self._names, self._grasps, self._trails.legs)

    def choose(self) -> list[Candidate]:
        """Return grasps that the hand can hold, the best first; only its way until here is told."""
        surface, judge = self._surface, self._judge
        assert surface is not None
        found: list[Candidate] = []
        names: dict[int, int] = {}  # of the grasps shown to the hand
        spanned = judge.spans(surface, self._grasps)
        order = list(judge.ranked(surface, self._grasps))
        for rank, promise in order:
            if judge.enough(found, promise):
                break
            if not spanned[rank] or not judge.closed(surface, self._grasps[rank]):
                continue
            held, posture = judge.held(surface, self._grasps[rank])
            if held:
                follower = self._follower(rank, self._grasps[rank], posture, names)
                judge.settle(follower, self._initial(rank), surface, found, placed=True)
        if not found:
            self._settle_anyhow(surface, [rank for rank, _ in order], found, names)
        judge.tried = self._started
        best_first = judge.best_first(found)
        for best in best_first[:1]:
            best.follower.via[:0] = self._trails.of(names[id(best.follower)])
        return best_first

    def _settle_anyhow(
        self, surface: Surface, order: list[int], found: list[Candidate], names: dict[int, int]
    ) -> None:
        """Let the hand lead grasps that it cannot hold as they are to some that it can."""
        for tries, rank in enumerate(order):
            for vertices in (self._grasps[rank], self._rough[self._names[rank]]):
                if found or tries > MAX_TRIES:
                    return
                follower = self._follower(rank, vertices, None, names)
                self._judge.settle(follower, self._initial(rank), surface, found)

    def _follower(
        self, rank: int, vertices: IntArray, posture: HandPosture | None, names: dict[int, int]
    ) -> Follower:
        """Return a grasp as the hand looks at it; its way until here is only added to the best one's."""
        name = int(self._names[rank])
        follower = Follower(vertices, posture, followed=self._followed[name])
        names[id(follower)] = name
        return follower

    def _initial(self, rank: int) -> InitialGrasp:
        return self._starts[int(self._names[rank])]

    def _start(self, surface: Surface) -> None:
        planner = self._judge.planner
        slow = not climbs_by_itself(self._judge.index)
        rotations, planes = (
            (1, min(SLOW_STARTS, planner.planes)) if slow else (planner.rotations, planner.planes)
        )
        of_planes = islice(initial_grasps(surface, self._n_f, rotations), planes)
        self._starts = [initial for plane in of_planes for initial in plane]
        if not self._starts:
            raise PlanningError(
                f"the surface has too few nodes for {self._n_f} contacts", remedy="raise surface.nodes"
            )
        self._started = len(self._starts)
        self._names = np.arange(self._started)
        self._grasps = np.stack([initial.vertices for initial in self._starts])
        self._followed, self._rough = self._grasps.copy(), self._grasps.copy()
        self._trails.stand(surface, self._names, self._grasps)

    def _arrive(self, before: Surface, surface: Surface) -> None:
        """Bring all grasps onto a surface; they go to other nodes only where the network is another."""
        if before.network is not surface.network and len(self._names):
            self._grasps = np.stack([carry_over(grasp, before, surface) for grasp in self._grasps])
            self._trails.stand(surface, self._names, self._grasps)

    def _recall(self, early: "_Early", surface: Surface) -> None:
        """Add grasps as they were on an early surface, under new names, to those under way."""
        names = len(self._starts) + np.arange(len(early.names))
        grasps = early.grasps
        self._starts += [self._starts[name] for name in early.names]
        self._trails.fork(names, early.names, early.legs)
        if early.surface.network is not surface.network:
            grasps = np.array([carry_over(grasp, early.surface, surface) for grasp in grasps])
            grasps = grasps.reshape(early.grasps.shape)
            self._trails.stand(surface, names, grasps)
        self._names = np.concatenate((self._names, names))
        self._grasps = np.concatenate((self._grasps, grasps))
        self._followed = np.concatenate((self._followed, grasps))
        self._rough = np.concatenate((self._rough, grasps))

    def _climb(self, surface: Surface, allowed: BoolArray, *, thorough: bool) -> None:
        index, max_moves = self._judge.index, self._judge.planner.max_moves
        climbs = climb_all(index, surface, self._grasps, allowed, thorough=thorough, max_moves=max_moves)
        self._trails.climb(surface, self._names, climbs)
        self._grasps = climbs.ends

    def _keep(self, ranks: IntArray) -> None:
        self._names, self._grasps = self._names[ranks], self._grasps[ranks]

    def _rank(self, surface: Surface) -> None:
        """Put the best first, what the hand spans before what it does not; give up those behind."""
        if not len(self._names):
            return
        best = scores(self._judge.index, surface, self._grasps)
        order = np.lexsort((-best, ~self._judge.spans(surface, self._grasps)))
        self._keep(order[: self._places(surface)])
        step = step_of(surface, self._grasps[0], float(best[order[0]]), len(self._names))
        self.steps.append(step)

    def _places(self, surface: Surface) -> int:
        """Return how many grasps go on: half of those too many for each surface that hardly moves."""
        alive, most = len(self._names), self._judge.planner.followers
        if alive <= most or self._before is None:
            return alive
        moved = mean_distance(self._before, surface)
        size = np.linalg.norm(surface.points - surface.centroid, axis=1).mean()
        if surface.at_rest:
            return most
        return most + (alive - most) // 2 if moved < _TIGHT * size else alive
