"""The search behind the local planner: one leading grasp, then many first grasps on the finished surface."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from graspbench.arrays import BoolArray, IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import GraspQuality, QualityParameters
from graspbench.hand.posture import HandPosture
from graspbench.planning.barrier import FreeMoves, KinematicBarrier
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.merit import best_first, merit_of, quality_of
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.screen import polish, screen
from graspbench.planning.settling import Checker, Settler, Track, settle
from graspbench.reconstruction.carrying import carry_over
from graspbench.reconstruction.surface import Surface

NOT_CLOSED = "not force closure"
TRIES_ONCE_FOUND, MOST_TRIES = 40, 120
"""Local optima of one batch that the hand tries at most: when some are grasps, and when none is."""

MOST_FIRST = 24
"""First grasps that the hand tries at most before one leads that it cannot hold yet."""


@dataclass(frozen=True)
class Candidate:
    """A local optimum that is a grasp."""

    track: Track
    initial: InitialGrasp
    quality: GraspQuality
    score: float
    merit: float


class LocalSearch:
    """The grasps under way.

    Args:
        index: What the fingers climb.
        checker: The hand; None plans without one.
        n_f: Number of contacts.
        planner: How to search.
        quality: How force closure and quality are measured.
    """

    def __init__(
        self,
        index: Index,
        checker: Checker | None,
        n_f: int,
        planner: PlannerParameters,
        quality: QualityParameters,
    ) -> None:
        self._index, self._checker, self._n_f = index, checker, n_f
        self._planner, self._quality = planner, quality
        if checker is not None:
            checker.set_object(None)
        self._barrier = (
            None
            if checker is None
            else KinematicBarrier(checker.hand, checker.ground_height_m, planner.barrier)
        )
        self._settler = Settler(
            index, self._barrier or FreeMoves(), checker, planner.max_moves, planner.wrist_moves
        )
        self._planes: Iterator[tuple[InitialGrasp, ...]] = iter(())
        self._seen: list[tuple[InitialGrasp, ...]] = []
        self._surfaces: list[Surface] = []
        self._lead = Track(np.empty(0, dtype=np.int64))
        self._lead_initial: InitialGrasp | None = None
        self._feasible = False
        self._measured: Surface | None = None
        self._length_m = 1.0
        self.tracks: list[Track] = []
        self.tried = 0
        self.iterations = 0
        self.rejected: Counter[str] = Counter()

    @property
    def contour_queries(self) -> int:
        """Finger solutions of the barrier."""
        return 0 if self._barrier is None else self._barrier.evaluations

    def follow(self, surface: Surface) -> None:
        """Move the leading grasp on the next surface."""
        self._surfaces.append(surface)
        self.iterations += 1
        if self._lead_initial is None:
            self._start(surface)
        if surface.at_rest and self._checker is not None:
            self._checker.set_object(surface.points, surface.network.faces)
        self._feasible = settle(self._lead, surface, self._settler)

    def choose(self) -> Candidate:
        """Finish the search on the last surface.

        Raises:
            PlanningError: Nothing found is a grasp.
        """
        if self._lead_initial is None:
            raise PlanningError("there was no surface to plan on", remedy="give at least one snapshot")
        surface = self._surfaces[-1]
        found: list[Candidate] = []
        self._judge(self._lead, self._lead_initial, surface, self._feasible, found)
        if self._planner.select == "first":
            self._try_in_order(surface, found)
        else:
            self._try_planes(surface, found)
            if not found:  # look closer before giving up
                self._planes = initial_grasps(self._surfaces[0], self._n_f, 3 * self._planner.rotations)
                self._seen = []
                self._try_planes(surface, found)
        if not found:
            raise self._failure()
        return max(found, key=lambda candidate: candidate.merit)

    def _try_in_order(self, surface: Surface, found: list[Candidate]) -> None:
        """Try one first grasp after the other until one ends in a grasp."""
        for plane in self._every_plane():
            for initial in plane:
                if found:
                    return
                if initial is not self._lead_initial:
                    self._try(surface, initial, [self._on(surface, initial).vertices], found)

    def _try_planes(self, surface: Surface, found: list[Candidate]) -> None:
        """Try the planes in their order, some at a time, until one holds a grasp."""
        planes = self._every_plane()
        while starts := [initial for plane in islice(planes, self._planner.planes) for initial in plane]:
            self._try_best_first(surface, starts, found)
            if found:
                return

    def _try_best_first(self, surface: Surface, starts: list[InitialGrasp], found: list[Candidate]) -> None:
        """Follow first grasps without the hand, then let the hand try the best local optima."""
        allowed = self._allowed(surface)
        here = [self._on(surface, initial) for initial in starts]
        optima = screen(self._index, surface, here, allowed, self._planner.max_moves)
        tracks_before = len(self.tracks)
        tried_before, enough = self.tried, len(found) + self._planner.candidates
        seen: set[tuple[int, ...]] = set()
        for rank, promise in self._ranked(surface, [optimum.vertices for optimum in optima]):
            if found and max(candidate.merit for candidate in found) >= promise:
                break  # what is left promises less than what the hand can hold already
            most = TRIES_ONCE_FOUND if found else MOST_TRIES
            if len(found) == enough or len(self.tracks) - tracks_before >= most:
                break
            rough, before = optima[rank], len(found)
            for optimum in (polish(self._index, surface, rough, allowed, self._planner.max_moves), rough):
                # Where the hand cannot hold the better one, the other may still do.
                if optimum.contacts not in seen and len(found) == before:
                    seen.add(optimum.contacts)
                    self._try(surface, optimum.initial, list(optimum.path), found)
        self.tried = tried_before + len(starts)

    def _ranked(self, surface: Surface, optima: list[IntArray]) -> Iterator[tuple[int, float]]:
        """Yield local optima and their merit, the best first; what is not force closure is left out."""
        if self._planner.select != "quality":
            scores = [self._index.score(surface, vertices) for vertices in optima]
            order = np.argsort([-score for score in scores], kind="stable")
            yield from ((int(rank), scores[rank]) for rank in order)
            return
        for rank, merit in best_first(surface, optima, self._quality, self._torque_length(surface)):
            if merit > 0.0:
                yield rank, merit
            else:
                self.tried += 1
                self.rejected[NOT_CLOSED] += 1

    def _on(self, surface: Surface, initial: InitialGrasp) -> InitialGrasp:
        """Return a grasp on the first surface as the one that continues it on another."""
        vertices = carry_over(initial.vertices, self._surfaces[0], surface)
        return initial if vertices is initial.vertices else replace(initial, vertices=vertices)

    def _every_plane(self) -> Iterator[tuple[InitialGrasp, ...]]:
        """Yield the first grasps of every plane, those of the leading grasp's plane first."""
        own = [plane for plane in self._seen if self._lead_initial in plane]
        others = [plane for plane in self._seen if self._lead_initial not in plane]
        yield from own
        yield from others
        yield from self._planes

    def _try(
        self, surface: Surface, initial: InitialGrasp, path: list[IntArray], found: list[Candidate]
    ) -> None:
        """Let the hand follow a path, then the index with the hand; keep what is a grasp."""
        track = Track(path[-1], moves=len(path) - 1, evaluations=len(path))
        track.via.append((self._surfaces[0], carry_over(path[0], surface, self._surfaces[0])))
        track.via.extend((surface, vertices) for vertices in path)
        feasible = settle(track, surface, self._settler)
        self._judge(track, initial, surface, feasible, found)

    def grasps(self, best: Candidate) -> tuple[Grasp, tuple[Grasp, ...]]:
        """Return the final grasp and the configurations that led to it."""
        history: list[Grasp] = []
        before: tuple[int, tuple[int, ...]] | None = None
        for surface, vertices in best.track.via:
            key = (id(surface), tuple(vertices.tolist()))
            if key != before:
                history.append(_grasp(surface, vertices, None))
            before = key
        grasp = _grasp(self._surfaces[-1], best.track.vertices, best.track.posture)
        return grasp, (*history[:-1], grasp)

    def _start(self, surface: Surface) -> None:
        """Choose the first grasp: in the best plane where the hand holds one, else in the best plane."""
        self._planes = initial_grasps(surface, self._n_f, self._planner.rotations)
        allowed, tries = self._allowed(surface), 0
        for plane in self._planes:
            self._seen.append(plane)
            for grasp in plane:
                if tries == MOST_FIRST or not np.all(allowed[grasp.vertices]):
                    continue
                if self._holds(surface, grasp.vertices):
                    return self._lead_with(grasp)
                tries += 1
        options = [grasp for plane in self._seen for grasp in plane]
        if not options:
            raise PlanningError(
                f"the surface has too few nodes for {self._n_f} contacts", remedy="raise surface.nodes"
            )
        self._lead_with(options[0])

    def _lead_with(self, grasp: InitialGrasp) -> None:
        self._lead_initial = grasp
        self._lead = Track(grasp.vertices)

    def _allowed(self, surface: Surface) -> BoolArray:
        """Tell which nodes a fingertip can touch at all, shape (n_s,)."""
        if self._checker is None:
            return np.ones(len(surface.points), dtype=np.bool_)
        return self._checker.vertex_mask(surface.points, surface.normals)

    def _holds(self, surface: Surface, vertices: IntArray) -> bool:
        if self._checker is None:
            return True
        return self._checker.place(surface.points[vertices], surface.normals[vertices]) is not None

    def _judge(
        self, track: Track, initial: InitialGrasp, surface: Surface, feasible: bool, found: list[Candidate]
    ) -> None:
        """Keep a local optimum that is a grasp; note why another one is not."""
        self.tried += 1
        self.tracks.append(track)
        points, normals = surface.points[track.vertices], surface.normals[track.vertices]
        if not feasible:
            assert self._checker is not None
            self.rejected[self._checker.reason(points, normals)] += 1
            return
        quality, score, merit = self._assess(surface, track.vertices)
        # The origin is inside the grasp wrench space exactly when a ball around it is.
        if quality.q3 <= CLOSURE_TOLERANCE:
            self.rejected[NOT_CLOSED] += 1
            return
        found.append(Candidate(track, initial, quality, score, merit))

    def _assess(self, surface: Surface, vertices: IntArray) -> tuple[GraspQuality, float, float]:
        """Return a grasp's quality, the index's score, and by what the best grasp is selected."""
        quality = quality_of(surface, vertices, self._quality, self._torque_length(surface))
        score = self._index.score(surface, vertices)
        return quality, score, merit_of(quality) if self._planner.select == "quality" else score

    def _torque_length(self, surface: Surface) -> float:
        if surface is not self._measured:
            self._measured = surface
            self._length_m = self._quality.torque_length_m(surface.points, surface.centroid)
        return self._length_m

    def _failure(self) -> PlanningError:
        reasons = ", ".join(f"{reason} ({count} times)" for reason, count in self.rejected.most_common(3))
        return PlanningError(
            f"none of {self.tried} first grasps of {self._n_f} fingers led to a grasp: {reasons}",
            remedy="try another hand, more fingers or a lower planner.barrier, or another index",
            reasons=dict(self.rejected),
            tried=self.tried,
        )


def _grasp(surface: Surface, vertices: IntArray, posture: HandPosture | None) -> Grasp:
    return Grasp(
        vertices=vertices,
        points=surface.points[vertices],
        normals=surface.normals[vertices],
        centroid=surface.centroid,
        posture=posture,
    )
