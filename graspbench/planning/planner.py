"""What a planner is to a trial: it sees a surface form, a hand and the ground, and yields grasps.

A planner is one file in `graspbench.planning.planners`, or a class of another distribution under the entry
point group ``graspbench.planner``. `Planner` is all that is asked of it. The module
`graspbench.planning.planners.random_closure` is written to be copied.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters
from graspbench.hand.posture import HandPosture
from graspbench.planning.index import Index
from graspbench.planning.on_surface import grasp_at
from graspbench.planning.parameters import AnyPlannerParameters
from graspbench.reconstruction.surface import Surface
from graspbench.registry import Registry

if TYPE_CHECKING:  # choosing a planner does not load what it plans with
    from graspbench.planning.constraint import HandConstraint
    from graspbench.planning.local import LocalPlan


@dataclass(frozen=True, eq=False)
class PlanningProblem:
    """All that a planner may see. Of the object itself it sees nothing but its reconstruction.

    Attributes:
        surfaces: Snapshots of the reconstruction, an ellipsoid first, one at rest last; made while they are
            asked for, to be read once. World frame, m.
        hand: The hand with its margins, and the ground (``hand.ground_height_m``); None plans without a hand.
            It places fingertips on contacts, and says which contacts no hand could hold.
        n_f: Number of contacts.
        index: What ``index=`` names; for planners that climb one.
        quality: Contact model, friction, and how force closure is measured.
        seed: Source of every random draw: the same seed gives the same grasps.
        time_limit_s: Time for all, the reconstruction included, s.
        started_s: When planning began, by `time.perf_counter`.
    """

    surfaces: Iterable[Surface]
    hand: "HandConstraint | None"
    n_f: int
    index: Index
    quality: QualityParameters
    seed: int = 0
    time_limit_s: float = 60.0
    started_s: float = field(default_factory=time.perf_counter)

    def time_left_s(self) -> float:
        """Return the seconds that are left; not positive when the time is up."""
        return self.time_limit_s - (time.perf_counter() - self.started_s)

    def finished_surface(self) -> Surface:
        """Wait for the surface at rest, make it the hand's obstacle, and return it.

        Its mesh is ``points`` with ``network.faces``. Call this once, in place of reading ``surfaces``.

        Raises:
            PlanningError: There was no surface.
        """
        snapshots = list(self.surfaces)
        if not snapshots:
            raise PlanningError("there was no surface to plan on", remedy="give at least one snapshot")
        last = snapshots[-1]
        if self.hand is not None:
            self.hand.set_object(last.points, last.network.faces)
        return last

    def rng(self) -> np.random.Generator:
        """Return a new generator of random numbers from the seed."""
        return np.random.default_rng(self.seed)


@dataclass(frozen=True, eq=False)
class FoundGrasp:
    """A grasp that a planner yields.

    Attributes:
        grasp: Contacts on the finished surface, with the posture that holds them (None without a hand).
        score: How good the planner finds it, higher is better; its own unit. The best one is executed.
        history: Configurations on the way to it, first to last, the grasp itself left out; via points of the
            fingertips' paths. Planners that have none leave it empty.
        details: How the local planner found it; for planners that climb an index.
    """

    grasp: Grasp
    score: float
    history: tuple[Grasp, ...] = ()
    details: "LocalPlan | None" = None


class Planner(Protocol):
    """A grasp planner.

    An implementation is a class whose constructor takes its own parameters. What it yields is checked
    independently: a grasp that is not force closure, or without the posture that a hand needs, counts as
    refused. A planner yields as soon as it has a grasp, and goes on as long as it can do better; whoever asks
    stops when the time is up. Between two grasps it looks at ``problem.time_left_s()`` itself.
    """

    parameters: ClassVar[type[AnyPlannerParameters]]
    """Frozen dataclass derived from `AnyPlannerParameters`, every field with a default: ``planner.*``."""

    climbs_index: ClassVar[bool]
    """Whether it climbs the configured index; tables then tell its grasps apart by the index."""

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        """Yield grasps, each as soon as it is found.

        Args:
            problem: What may be seen.

        Raises:
            PlanningError: It gives up; the message says why. Grasps that were yielded before stay.
        """
        ...


PLANNERS: Registry[Any] = Registry("planner", "graspbench.planning.planners")
"""All planners by name; other distributions add theirs by the entry point group ``graspbench.planner``."""


def make_planner(name: str, parameters: AnyPlannerParameters) -> Planner:
    """Build a registered planner.

    Args:
        name: Its registered name.
        parameters: An instance of its ``parameters`` dataclass.

    Raises:
        ConfigurationError: No such planner.
    """
    planner: Planner = PLANNERS[name](parameters)
    return planner


def placed_grasp(
    problem: PlanningProblem,
    surface: Surface,
    vertices: np.ndarray[Any, Any],
    start: HandPosture | None = None,
) -> Grasp | None:
    """Return the grasp at some nodes of the finished surface with the hand holding it, or None.

    Args:
        problem: The hand.
        surface: The finished surface.
        vertices: The nodes, shape (n_f,).
        start: A posture for similar contacts in the same order, to begin with; tried first.
    """
    if problem.hand is None:
        return grasp_at(surface, vertices, None)
    points, normals = surface.points[vertices], surface.normals[vertices]
    if problem.hand.excludes(points, normals):
        return None
    posture = problem.hand.place(points, normals, start=start)
    return None if posture is None else grasp_at(surface, vertices, posture)
