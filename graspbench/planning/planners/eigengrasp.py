"""A baseline as GraspIt!'s users know it: simulated annealing of wrist and eigengrasps (Ciocarlie and Allen).

The hand as a whole is moved about the object: six coordinates of the wrist and the amplitudes of a few
postural synergies, six and two by default. What is annealed is the contact energy, without the exact grasp:
distances of the fingertips to the surface and how squarely they would push. States in which palm or links
would be inside the object, the ground or each other are not entered. The best states are then completed: the
fingertips are brought onto the surface, here by inverse kinematics where GraspIt! closes joint by joint, and
the grasps are scored by Q3, GraspIt!'s epsilon quality.

M. T. Ciocarlie, P. K. Allen: Hand posture subspaces for dexterous robotic grasping. Int. J. Robotics
Research 28(7), 2009.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.probe import HandProbe
from graspbench.hand.synergies import Synergies, synergies
from graspbench.planning.contact_energy import ContactEnergy
from graspbench.planning.merit import quality_of
from graspbench.planning.parameters import AnyPlannerParameters
from graspbench.planning.planner import PLANNERS, FoundGrasp, PlanningProblem, placed_grasp
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class EigengraspParameters(AnyPlannerParameters):
    """How wrist and eigengrasps are annealed."""

    eigengrasps: Annotated[
        int, Field(ge=1, le=16, description="Postural synergies that are varied, the most frequent first")
    ] = 2
    steps: Annotated[int, Field(ge=10, description="Steps of one annealing")] = 1500
    anneals: Annotated[int, Field(ge=1, description="Annealings, each from a start of its own")] = 16
    grasps: Annotated[int, Field(ge=1, description="Grasps that the hand holds, to choose from by Q3")] = 8
    kept: Annotated[
        int, Field(ge=1, description="Best states of an annealing that are completed to grasps")
    ] = 20
    hot: Annotated[float, Field(gt=0, description="Temperature at the start, in units of the energy")] = 0.3
    cold: Annotated[float, Field(gt=0, description="Temperature at the end")] = 0.003
    step_m: Annotated[
        float, Field(gt=0, description="Standard deviation of the wrist's steps while it is hot, m")
    ] = 0.02
    step_deg: Annotated[
        float, Field(gt=0, description="Standard deviation of its turns while it is hot, deg")
    ] = 25.0
    step_amplitude: Annotated[
        float, Field(gt=0, description="Standard deviation of the amplitudes' steps while it is hot")
    ] = 0.6


@dataclass(frozen=True, eq=False)
class _State:
    """A hand near the object: wrist, shape (4, 4), amplitudes, shape (k,), joints, shape (n_q,)."""

    wrist: FloatArray
    amplitudes: FloatArray
    joints: FloatArray
    energy: float
    nodes: IntArray


@PLANNERS.register("eigengrasp")
class Eigengrasp:
    """Anneals wrist and eigengrasps by contact energy, and completes the best states.

    Args:
        parameters: How to anneal.
    """

    parameters: ClassVar[type[AnyPlannerParameters]] = EigengraspParameters
    climbs_index: ClassVar[bool] = False

    def __init__(self, parameters: EigengraspParameters) -> None:
        self._parameters = parameters

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        """Yield completed grasps, those of each annealing by energy; the score is Q3.

        Raises:
            PlanningError: There is no hand.
        """
        if problem.hand is None:
            raise PlanningError("eigengrasps are a hand's", remedy="choose another planner without a hand")
        surface, left = problem.finished_surface(), self._parameters.grasps
        annealing = _Annealing(problem, surface, self._parameters)
        length_m = problem.quality.torque_length_m(surface.points, surface.centroid)
        seen: set[tuple[int, ...]] = set()
        for _ in range(self._parameters.anneals):
            for state in annealing.best_states():
                contacts = tuple(sorted(state.nodes.tolist()))
                if left == 0 or problem.time_left_s() <= 0.0:
                    return
                if contacts in seen or len(set(contacts)) < len(contacts):
                    continue
                seen.add(contacts)
                q3 = float(quality_of(surface, state.nodes, problem.quality, length_m).q3)
                if q3 <= CLOSURE_TOLERANCE:
                    continue
                grasp = placed_grasp(problem, surface, state.nodes, annealing.posture(state))
                if grasp is not None:
                    left -= 1
                    yield FoundGrasp(grasp, q3)


class _Annealing:
    """Anneals again and again, on one surface with one hand."""

    def __init__(self, problem: PlanningProblem, surface: Surface, parameters: EigengraspParameters) -> None:
        assert problem.hand is not None
        self._hand: HandModel = problem.hand.hand
        self._problem, self._surface, self._p = problem, surface, parameters
        self._rng = problem.rng()
        self._synergies: Synergies = synergies(self._hand, parameters.eigengrasps)
        self._energy = ContactEnergy(surface, self._hand.tip_radius_m)
        self._probe = HandProbe(
            self._hand, problem.hand.ground_height_m, surface.points, surface.network.faces
        )

    def best_states(self) -> list[_State]:
        """Anneal once; return the best states met, different in the nodes nearest to the tips."""
        p, state = self._p, self._start()
        best: dict[tuple[int, ...], _State] = {}
        cooling = (p.cold / p.hot) ** (1.0 / p.steps)
        temperature = p.hot
        for _ in range(p.steps):
            temperature *= cooling
            other = self._neighbour(state, max(np.sqrt(temperature / p.hot), 0.05))
            gain = state.energy - other.energy
            if gain < 0.0 and self._rng.random() >= np.exp(gain / temperature):
                continue
            if not self._probe.is_clear(other.wrist, other.joints):
                continue
            state = other
            nodes = tuple(state.nodes.tolist())
            if nodes not in best or best[nodes].energy > state.energy:
                best[nodes] = state
            if self._problem.time_left_s() <= 0.0:
                break
        return sorted(best.values(), key=lambda each: each.energy)[: p.kept]

    def posture(self, state: _State) -> HandPosture:
        """Return a state as a posture to begin with; contact i belongs to finger i."""
        fingers = tuple(range(self._problem.n_f))
        return HandPosture(state.wrist, state.joints, fingers, np.inf, 0.0, 0.0, 0.0)

    def _state(self, wrist: FloatArray, amplitudes: FloatArray) -> _State:
        joints = self._synergies.joints(amplitudes, self._hand)
        tips = self._probe.tips(wrist, joints)[: self._problem.n_f]
        energy, nodes = self._energy(tips)
        return _State(wrist, amplitudes, joints, energy, nodes)

    def _start(self) -> _State:
        """Return a hand that looks at the object from a random side, the fingertips around its centroid."""
        wrist = np.eye(4)
        approach = self._rng.normal(size=3)
        if self._problem.hand is not None and self._problem.hand.ground_height_m is not None:
            approach[2] = -abs(approach[2])
        approach /= np.linalg.norm(approach)
        turned, _ = Rotation.align_vectors(approach[None], [[0.0, 0.0, 1.0]])
        roll = Rotation.from_rotvec([0.0, 0.0, self._rng.uniform(0.0, 2.0 * np.pi)])
        wrist[:3, :3] = (turned * roll).as_matrix()
        amplitudes = np.zeros(len(self._synergies.directions))
        middle = self._hand.tip_positions(self._synergies.mean).mean(axis=0)
        wrist[:3, 3] = self._surface.centroid - wrist[:3, :3] @ middle
        # Back until nothing is inside anything.
        for _ in range(30):
            if self._probe.is_clear(wrist, self._synergies.joints(amplitudes, self._hand)):
                break
            wrist[:3, 3] -= 0.01 * approach
        return self._state(wrist, amplitudes)

    def _neighbour(self, state: _State, scale: float) -> _State:
        """Return a state near another one; steps shrink as it gets cold."""
        p, rng = self._p, self._rng
        wrist = state.wrist.copy()
        turn = Rotation.from_rotvec(scale * np.radians(p.step_deg) * rng.normal(size=3) / np.sqrt(3.0))
        # About the fingertips, which stay near the surface, not about the palm.
        pivot = wrist[:3, :3] @ self._hand.tip_positions(state.joints).mean(axis=0) + wrist[:3, 3]
        wrist[:3, :3] = turn.as_matrix() @ wrist[:3, :3]
        wrist[:3, 3] = pivot + turn.apply(wrist[:3, 3] - pivot)
        wrist[:3, 3] += scale * p.step_m * rng.normal(size=3) / np.sqrt(3.0)
        reach = 1.2 * self._synergies.reach
        moved = state.amplitudes + scale * p.step_amplitude * rng.normal(size=len(state.amplitudes))
        return self._state(wrist, np.clip(moved, -reach, reach))
