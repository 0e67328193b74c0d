"""The local planner: grasp and surface take shape together (thesis 3.4)."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from time import perf_counter
from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import GraspQuality, QualityParameters, grasp_quality
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.planning.barrier import FreeMoves, KinematicBarrier
from graspbench.planning.concurrent import ConcurrentSurfaces, TimedSurfaces
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.track import Placer, Settler, Track, settle
from graspbench.reconstruction.surface import Surface


class Checker(Placer, Protocol):
    """The part of a grasp checker that the local planner needs."""

    @property
    def hand(self) -> HandModel:
        """The hand."""
        ...

    @property
    def ground_height_m(self) -> float | None:
        """Height of the ground."""
        ...


@dataclass(frozen=True)
class LocalPlan:
    """A grasp found by the local planner, and how.

    Attributes:
        grasp: Force closure; its posture is feasible (None when planned without a hand).
        history: The configurations on the way, first to last, one a move and one a surface.
        quality: The grasp's Q1, Q2 and Q3.
        score: What the index thinks of it; the index's own unit.
        initial: The equilateral grasp it began with.
        rotations_tried: First grasps that were followed to a local optimum.
        rejected: Why local optima were not grasps: how often each reason came up.
        iterations: Surfaces that were planned on.
        surfaces_made: Surfaces that were made.
        moves: Moves of all tried grasps.
        evaluations: Proposals asked from the index.
        contour_queries: Inverse kinematics of fingers at contour points.
        cycles: Times an index wanted back to a configuration it had left.
        force_closure: Always True: nothing else is called a grasp.
        reconstruction_time_s: Time of the reconstruction alone.
        planning_time_s: Time of the planner alone.
        time_s: Time of both together, as waited for.
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    quality: GraspQuality
    score: float
    initial: InitialGrasp
    rotations_tried: int
    rejected: dict[str, int]
    iterations: int
    surfaces_made: int
    moves: int
    evaluations: int
    contour_queries: int
    cycles: int
    force_closure: bool
    reconstruction_time_s: float
    planning_time_s: float
    time_s: float


@dataclass(frozen=True)
class _Candidate:
    """A local optimum that is a grasp."""

    track: Track
    initial: InitialGrasp
    quality: GraspQuality
    score: float
    merit: float


def plan_local(
    surfaces: Iterable[Surface],
    index: Index,
    checker: Checker | None,
    n_f: int,
    planner: PlannerParameters,
    quality: QualityParameters,
) -> LocalPlan:
    """Plan a grasp while the surface shrinks onto the object.

    The first equilateral grasp is moved on every surface until no finger wants to move. Once the surface is at
    rest, the further rotations of that first grasp are moved too, and the planes after the first one when none
    of its rotations ends in a grasp. A local optimum that is not force closure, or that the hand cannot hold, is
    never a grasp.

    Args:
        surfaces: Snapshots of the reconstruction, an ellipsoid first, one at rest last; taken lazily.
        index: What the fingers climb.
        checker: The hand; None plans without one.
        n_f: Number of contacts.
        planner: How to search.
        quality: How force closure and quality are measured.

    Raises:
        PlanningError: No rotation ends in a grasp; the message says why.
    """
    started = perf_counter()
    source = ConcurrentSurfaces(surfaces) if planner.mode == "concurrent" else TimedSurfaces(surfaces)
    search = _Search(index, checker, n_f, planner, quality)
    waited = perf_counter()
    waiting = 0.0
    for surface in source:
        waiting += perf_counter() - waited
        search.follow(surface)
        waited = perf_counter()
    waiting += perf_counter() - waited
    best = search.choose()
    finished = perf_counter()
    grasp, history = search.grasps(best)
    return LocalPlan(
        grasp=grasp,
        history=history,
        quality=best.quality,
        score=best.score,
        initial=best.initial,
        rotations_tried=search.tried,
        rejected=dict(search.rejected),
        iterations=search.iterations,
        surfaces_made=source.made,
        moves=sum(track.moves for track in search.tracks),
        evaluations=sum(track.evaluations for track in search.tracks),
        contour_queries=search.contour_queries,
        cycles=sum(track.cycles for track in search.tracks),
        force_closure=True,
        reconstruction_time_s=source.busy_s,
        planning_time_s=finished - started - waiting,
        time_s=finished - started,
    )


class _Search:
    """The grasps under way."""

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
        self._barrier = (
            None
            if checker is None
            else KinematicBarrier(checker.hand, checker.ground_height_m, planner.barrier)
        )
        self._settler = Settler(
            index, self._barrier or FreeMoves(), checker, planner.max_moves, planner.wrist_moves
        )
        self._planes: list[tuple[InitialGrasp, ...]] = []
        self._surfaces: list[Surface] = []
        self._lead = Track(np.empty(0, dtype=np.int64))
        self._lead_initial: InitialGrasp | None = None
        self._feasible = False
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
        self._feasible = settle(self._lead, surface, self._settler)

    def choose(self) -> _Candidate:
        """Finish the search on the last surface.

        Raises:
            PlanningError: Nothing found is a grasp.
        """
        if self._lead_initial is None:
            raise PlanningError("there was no surface to plan on", remedy="give at least one snapshot")
        lead, surface = self._lead_initial, self._surfaces[-1]
        found: list[_Candidate] = []
        self._judge(self._lead, lead, surface, self._feasible, found)
        first_only = self._planner.select == "first"
        planes = [self._planes[lead.plane], *(p for p in self._planes if p and p[0].plane != lead.plane)]
        for plane in planes:
            for initial in plane:
                if initial is lead or (found and first_only):
                    continue
                track = Track(initial.vertices)
                track.via.append((self._surfaces[0], initial.vertices))
                feasible = settle(track, surface, self._settler)
                self._judge(track, initial, surface, feasible, found)
            if found:
                return max(found, key=lambda candidate: candidate.merit)
        raise self._failure()

    def grasps(self, best: _Candidate) -> tuple[Grasp, tuple[Grasp, ...]]:
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
        """Choose the first grasp: the best plane with a rotation that the hand can hold, else the best plane."""
        self._planes = list(initial_grasps(surface, self._n_f, self._planner.rotations))
        options = list(chain.from_iterable(self._planes))
        if not options:
            raise PlanningError(
                f"the surface has too few nodes for {self._n_f} contacts", remedy="raise surface.nodes"
            )
        chosen = next((grasp for grasp in options if self._holds(surface, grasp.vertices)), options[0])
        self._lead_initial = chosen
        self._lead = Track(chosen.vertices)

    def _holds(self, surface: Surface, vertices: IntArray) -> bool:
        if self._checker is None:
            return True
        return self._checker.place(surface.points[vertices], surface.normals[vertices]) is not None

    def _judge(
        self, track: Track, initial: InitialGrasp, surface: Surface, feasible: bool, found: list[_Candidate]
    ) -> None:
        """Keep a local optimum that is a grasp; note why another one is not."""
        self.tried += 1
        self.tracks.append(track)
        points, normals = surface.points[track.vertices], surface.normals[track.vertices]
        if not feasible:
            assert self._checker is not None
            self.rejected[self._checker.reason(points, normals)] += 1
            return
        length = self._quality.torque_length_m(surface.points, surface.centroid)
        if not force_closure(points, -normals, surface.centroid, self._quality, length):
            self.rejected["not force closure"] += 1
            return
        quality = _quality(points, normals, surface.centroid, self._quality, length)
        score = self._index.score(surface, track.vertices)
        # The geometric mean does not depend on the units of the three measures.
        by_quality = self._planner.select == "quality"
        merit = float(np.cbrt(quality.q1 * quality.q2 * quality.q3)) if by_quality else score
        found.append(_Candidate(track, initial, quality, score, merit))

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


def _quality(
    points: FloatArray, normals: FloatArray, centroid: FloatArray, quality: QualityParameters, length_m: float
) -> GraspQuality:
    return grasp_quality(
        points,
        -normals,
        centroid,
        contact=quality.contact,
        wrench_space=quality.wrench_space,
        friction=quality.friction,
        cone_edges=quality.cone_edges,
        torque_length=length_m,
        torsional_friction=quality.torsional_friction,
        norm=quality.norm,
    )
