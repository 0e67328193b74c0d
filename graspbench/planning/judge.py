"""What becomes of a local optimum: a closed grasp that the hand holds, or a reason why it is none."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import BoolArray, IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.closure import CLOSURE_TOLERANCE, force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.internal_forces import friction_reserve
from graspbench.grasp.quality import GraspQuality, QualityParameters
from graspbench.hand.posture import HandPosture
from graspbench.planning.barrier import FreeMoves, KinematicBarrier
from graspbench.planning.climbing import scores
from graspbench.planning.constraint import HandConstraint
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp
from graspbench.planning.merit import best_first, merit_of, quality_of
from graspbench.planning.on_surface import grasp_at
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.robustness import Robustness
from graspbench.planning.settling import Follower, Settler, settle
from graspbench.reconstruction.surface import Surface

NOT_CLOSED = "not force closure"


@dataclass(frozen=True)
class Candidate:
    """A local optimum that is a grasp.

    Attributes:
        follower: How it was reached, and the hand there.
        initial: The first grasp it began with.
        quality: Its Q1, Q2 and Q3.
        score: What the index thinks of it.
        merit: What the best grasp is selected by.
        reserve: Share of its friction that each contact keeps when the fingers squeeze, up to what is wanted;
            1 where nobody asks.
    """

    follower: Follower
    initial: InitialGrasp
    quality: GraspQuality
    score: float
    merit: float
    reserve: float


class Judge:
    """Lets the hand have its say on local optima, and keeps count.

    Args:
        index: What the fingers climb.
        checker: The hand; None plans without one.
        planner: How to search.
        quality: How force closure and quality are measured.
    """

    def __init__(
        self,
        index: Index,
        checker: HandConstraint | None,
        planner: PlannerParameters,
        quality: QualityParameters,
    ) -> None:
        self.index, self.checker, self.planner = index, checker, planner
        self._quality = quality
        if checker is not None:
            checker.set_object(None)
        self._barrier = (
            None
            if checker is None
            else KinematicBarrier(checker.hand, checker.ground_height_m, planner.barrier)
        )
        self.settler = Settler(
            index, self._barrier or FreeMoves(), checker, planner.max_moves, planner.wrist_moves
        )
        self._measured: Surface | None = None
        self._length_m = 1.0
        self._robustness: Robustness | None = None
        self.followers: list[Follower] = []
        self.tried = 0
        self.rejected: Counter[str] = Counter()

    @property
    def robust(self) -> bool:
        """Whether the most robust of the index's best grasps is taken."""
        return self.planner.select == "index" and self.planner.robust.among > 1

    @property
    def reserves(self) -> bool:
        """Whether friction in reserve decides among grasps that the index thinks equal."""
        planner, contact = self.planner, self._quality.contact
        wanted = planner.select == "index" and planner.robust.reserve > 0.0
        return wanted and not self.robust and contact != "frictionless"

    @property
    def wanted(self) -> int:
        """How many grasps that the hand holds to choose from."""
        if self.robust:
            return self.planner.robust.among
        return self.planner.robust.equals if self.reserves else self.planner.candidates

    def enough(self, found: Sequence[Candidate], promise: float) -> bool:
        """Tell whether grasps that the hand holds leave nothing to hope for from the next local optimum.

        Args:
            found: The grasps so far.
            promise: What the index thinks of that optimum, or its merit; no later one promises more.
        """
        if len(found) >= self.wanted:
            return True
        if self.robust or not found:
            return False
        least = self._least_equal(found)
        return promise < least or (promise <= self.best(found).merit and self._firm(self.best(found)))

    def best(self, found: Sequence[Candidate]) -> Candidate:
        """Return the grasp to keep of some, at least one.

        It has the largest merit. With friction in reserve wanted, it is the first by merit of those within
        the tolerance that have it, or else the one of them that has most.
        """
        equal = [candidate for candidate in found if candidate.merit >= self._least_equal(found)]
        firm = [candidate for candidate in equal if self._firm(candidate)]
        if firm:
            return max(firm, key=lambda candidate: candidate.merit)
        return max(equal, key=lambda candidate: candidate.reserve)

    def best_first(self, found: Sequence[Candidate]) -> list[Candidate]:
        """Return grasps with the one to keep first, and the others by merit; equals as they came."""
        if not found:
            return []
        best = self.best(found)
        return sorted(found, key=lambda candidate: (candidate is not best, -candidate.merit))

    def _least_equal(self, found: Sequence[Candidate]) -> float:
        """Return the merit down to which grasps count as equal to the best of some."""
        top = max(candidate.merit for candidate in found)
        return top - self.planner.robust.tolerance * abs(top) if self.reserves else top

    def _firm(self, candidate: Candidate) -> bool:
        return not self.reserves or candidate.reserve >= self.planner.robust.reserve

    @property
    def contour_queries(self) -> int:
        """Finger solutions of the barrier."""
        return 0 if self._barrier is None else self._barrier.evaluations

    def see(self, surface: Surface) -> None:
        """Let the hand know a surface; one at rest is an obstacle."""
        if surface.at_rest and self.checker is not None:
            self.checker.set_object(surface.points, surface.network.faces)

    def allowed(self, surface: Surface) -> BoolArray:
        """Tell which nodes a fingertip can touch at all, shape (n_s,)."""
        if self.checker is None:
            return np.ones(len(surface.points), dtype=np.bool_)
        return self.checker.vertex_mask(surface.points, surface.normals)

    def spans(self, surface: Surface, grasps: IntArray) -> BoolArray:
        """Tell of which grasps no two contacts are farther apart than the hand reaches, shape (m,).

        Args:
            surface: The surface now.
            grasps: Vertices, shape (m, n_f).
        """
        if self.checker is None:
            return np.ones(len(grasps), dtype=np.bool_)
        points = surface.points[grasps]
        gaps = points[:, :, None] - points[:, None]
        widest = np.einsum("mijk,mijk->mij", gaps, gaps).max(axis=(1, 2), initial=0.0)
        return np.asarray(np.sqrt(widest) <= self.checker.pair_limit_m)

    def held(self, surface: Surface, vertices: IntArray) -> tuple[bool, HandPosture | None]:
        """Tell whether the hand has a posture for these contacts, and which; without a hand there is none."""
        if self.checker is None:
            return True, None
        posture = self.checker.place(surface.points[vertices], surface.normals[vertices])
        return posture is not None, posture

    def closed(self, surface: Surface, vertices: IntArray) -> bool:
        """Tell whether a grasp is force closure; note it where it is not."""
        points, normals = surface.points[vertices], -surface.normals[vertices]
        length_m = self._torque_length(surface)
        closed = bool(force_closure(points, normals, surface.centroid, self._quality, length_m))
        if not closed:
            self.rejected[NOT_CLOSED] += 1
        return closed

    def ranked(self, surface: Surface, optima: IntArray) -> Iterator[tuple[int, float]]:
        """Yield local optima and their merit, the best first; by quality, only those that are closed.

        Args:
            surface: The surface at rest.
            optima: Vertices, shape (m, n_f).
        """
        if self.planner.select != "quality":
            values = scores(self.index, surface, optima)
            yield from ((int(rank), float(values[rank])) for rank in np.argsort(-values, kind="stable"))
            return
        for rank, merit in best_first(surface, list(optima), self._quality, self._torque_length(surface)):
            if merit > 0.0:
                yield rank, merit
            else:
                self.tried += 1
                self.rejected[NOT_CLOSED] += 1

    def settle(
        self,
        follower: Follower,
        initial: InitialGrasp,
        surface: Surface,
        found: list[Candidate],
        *,
        placed: bool = False,
    ) -> None:
        """Let the index move a grasp on as the hand allows; keep what is a grasp then.

        Args:
            follower: The grasp.
            initial: The first grasp it began with.
            surface: The surface at rest.
            found: What is a grasp is added.
            placed: Whether the follower's posture holds it already.
        """
        feasible = settle(follower, surface, self.settler, placed=placed)
        self.judge(follower, initial, surface, feasible, found)

    def judge(
        self,
        follower: Follower,
        initial: InitialGrasp,
        surface: Surface,
        feasible: bool,
        found: list[Candidate],
    ) -> None:
        """Keep a local optimum that is a grasp; note why another one is not."""
        self.tried += 1
        self.followers.append(follower)
        points, normals = surface.points[follower.vertices], surface.normals[follower.vertices]
        if not feasible:
            assert self.checker is not None
            self.rejected[self.checker.reason(points, normals)] += 1
            return
        quality = quality_of(surface, follower.vertices, self._quality, self._torque_length(surface))
        # The origin is inside the grasp wrench space exactly when a ball around it is.
        if quality.q3 <= CLOSURE_TOLERANCE:
            self.rejected[NOT_CLOSED] += 1
            return
        score = self.index.score(surface, follower.vertices)
        merit = self._robust_merit(surface, follower.vertices)
        if merit is None:
            merit = merit_of(quality) if self.planner.select == "quality" else score
        reserve = 1.0
        if self.reserves:
            reserve = friction_reserve(
                points - surface.centroid, -normals, self._quality.friction, self.planner.robust.reserve
            )
        found.append(Candidate(follower, initial, quality, score, merit, reserve))

    def qualities_on(self, surface: Surface, grasps: IntArray) -> list[GraspQuality]:
        """Return Q1, Q2 and Q3 of many grasps on a surface, vertices of shape (m, n_f)."""
        measured = quality_of(surface, grasps, self._quality, self._torque_length(surface))
        return [GraspQuality(*values) for values in np.column_stack(measured).tolist()]

    def failure(self, n_f: int) -> PlanningError:
        """Return an error that says why nothing is a grasp."""
        reasons = ", ".join(f"{reason} ({count} times)" for reason, count in self.rejected.most_common(3))
        return PlanningError(
            f"none of {self.tried} first grasps of {n_f} fingers led to a grasp: {reasons}",
            remedy="try another hand, more fingers or a lower planner.barrier, or another index",
            reasons=dict(self.rejected),
            tried=self.tried,
        )

    def _robust_merit(self, surface: Surface, vertices: IntArray) -> float | None:
        """Return the expected Q3 under errors; None where robustness does not decide."""
        if not self.robust:
            return None
        if self._robustness is None or self._robustness.surface is not surface:
            self._robustness = Robustness(surface, self._quality, self.planner.robust)
        return self._robustness.expected_q3(vertices)

    def _torque_length(self, surface: Surface) -> float:
        if surface is not self._measured:
            self._measured = surface
            self._length_m = self._quality.torque_length_m(surface.points, surface.centroid)
        return self._length_m


def route(follower: Follower, last: Surface) -> tuple[Grasp, tuple[Grasp, ...]]:
    """Return a follower's final grasp, and the configurations that led to it, the final one last.

    Args:
        follower: Where it went.
        last: The surface it ended on.
    """
    history: list[Grasp] = []
    before: tuple[int, tuple[int, ...]] | None = None
    for surface, vertices in follower.via:
        key = (id(surface), tuple(vertices.tolist()))
        if key != before:
            history.append(grasp_at(surface, vertices, None))
        before = key
    grasp = grasp_at(last, follower.vertices, follower.posture)
    return grasp, (*history[:-1], grasp)
