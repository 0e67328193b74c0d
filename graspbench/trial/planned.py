"""The front half of a trial: from images to a planned grasp."""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import HandError
from graspbench.geometry import ObjectModel, load_object
from graspbench.geometry.width import smallest_width
from graspbench.grasp import Grasp
from graspbench.hand import GraspChecker, HandModel, load_hand
from graspbench.perception import Silhouette, View
from graspbench.perception import silhouettes as find_silhouettes
from graspbench.perception.images import load_views
from graspbench.planning import (
    Plan,
    PlanningProblem,
    centre_gain,
    make_index,
    make_planner,
    plan_with,
)
from graspbench.reconstruction import Surface, reconstruct
from graspbench.simulation.mounts.arm_file import read_arm
from graspbench.trial.clock import StageClock
from graspbench.trial.evidence import Evidence
from graspbench.trial.moving import FollowedObject, follow_object

if TYPE_CHECKING:
    from graspbench.simulation import World
    from graspbench.simulation.execution_result import Motion
    from graspbench.trial.exploring import Explored
    from graspbench.trial.strengthening import Strengthened


@dataclass(frozen=True)
class Scene:
    """What the camera looked at, when it was simulated.

    Attributes:
        world: The simulated world, open for the execution.
        model: The object.
        transform_object_to_world: Where the object was when the images were taken, shape (4, 4).
    """

    world: "World"
    model: ObjectModel
    transform_object_to_world: FloatArray


@dataclass(frozen=True)
class PlannedTrial:
    """A trial up to its plan.

    Attributes:
        name: What the object is called.
        scene: The simulated scene; None when the images came from files.
        hand: The hand.
        checker: The hand's constraints, with the finished surface as obstacle.
        views: The images.
        silhouettes: Their silhouettes.
        surfaces: The reconstruction's snapshots, the last one at rest.
        plan: What the planner found.
        followed: The moving object, if it moves; then all of the above is as at its reference time.
        strengthened: What is executed in place of the plan's grasp; None where that is executed.
        explored: What exploring grasps felt, the best of which is executed in place of both.
    """

    name: str
    scene: Scene | None
    hand: HandModel
    checker: GraspChecker
    views: tuple[View, ...]
    silhouettes: tuple[Silhouette, ...]
    surfaces: list[Surface]
    plan: Plan
    followed: FollowedObject | None = None
    strengthened: "Strengthened | None" = None
    explored: "Explored | None" = None

    @property
    def executed(self) -> "Plan | Strengthened | Explored":
        """Whose grasp and history are executed."""
        if self.explored is not None:
            return self.explored
        return self.plan if self.strengthened is None else self.strengthened


@contextmanager
def planned_trial(
    config: TrialConfig, clock: StageClock, evidence: Evidence | None = None
) -> Iterator[PlannedTrial]:
    """Take images, reconstruct and plan; the simulated world stays open inside the block.

    Args:
        config: What to run.
        clock: Times the stages.
        evidence: Filled on the way.

    Raises:
        InputError: What the configuration names cannot be used.
        TrialError: No surface or no grasp was found.
    """
    evidence = evidence or Evidence()
    fingers = config.hand.fingers
    index = make_index(config.index_name, config.index, fingers, config.quality)
    planner = make_planner(config.planner_name, config.planner)
    with clock.stage("hand"):
        hand = load_hand(config.hand)
        checker = GraspChecker(hand, 0.0 if config.surface.ground else None)
        if config.arm.urdf is not None:
            read_arm(config.arm)  # refused before anything is planned
    with ExitStack() as stack:
        followed, scene, silhouettes = None, None, None
        if config.scene.source == "images":
            name = str(config.scene.images_dir)
            with clock.stage("images"):
                views = load_views(config.scene.images_dir, config.scene.exif_orientation)
        else:
            model = _load(config, checker, clock)
            name = model.name
            if config.scene.motion == "none":
                scene, views = _photograph(config, model, clock, stack)
            else:
                followed, views, silhouettes = follow_object(config, model, clock, stack)
                scene = Scene(followed.world, model, followed.reference_pose)
        evidence.views = tuple(views)
        if silhouettes is None:
            silhouettes = clock.run("silhouettes", partial(find_silhouettes, views, config.silhouette))
        evidence.silhouettes = silhouettes
        outlines = silhouettes

        def plan_while_forming() -> tuple[list[Surface], Plan]:
            surfaces: list[Surface] = []
            evidence.surfaces = surfaces
            snapshots = clock.producing("reconstruction", reconstruct(outlines, config.surface), surfaces)
            problem = PlanningProblem(
                snapshots, checker, fingers, index, config.quality, config.seed, config.planner.time_limit_s
            )
            plan = plan_with(planner, problem)
            clock.add("local_planning", plan.planning_time_s)
            return surfaces, plan

        surfaces, plan = clock.run_timed("local_planning", plan_while_forming)
        yield PlannedTrial(name, scene, hand, checker, views, silhouettes, surfaces, plan, followed)


def film(config: TrialConfig, trial: PlannedTrial, motion: "Motion", folder: Path, clock: StageClock) -> None:
    """Film what was executed, if that is asked for."""
    if trial.scene is None or not config.record.video:
        return
    from graspbench.simulation.film import film_execution

    with clock.stage("video"):
        film_execution(folder, trial.scene.model, config.scene, trial.hand, motion)


def centre_tolerance_m(config: TrialConfig, planned: Iterable[Grasp]) -> float | None:
    """Return how far the centre of grip may be from the centroid; None when the index does not ask.

    The search gets at least the freedom that the planned grasps took, or they could not be compared.
    """
    if not centre_gain(config.index_name, config.index):
        return None
    taken = max(float(np.linalg.norm(grasp.points.mean(axis=0) - grasp.centroid)) for grasp in planned)
    return max(config.search.centre_tolerance_m, 1.001 * taken)


def reconstructed(config: TrialConfig) -> list[Surface]:
    """Photograph the simulated object and reconstruct it; nothing is planned.

    Returns:
        The reconstruction's snapshots, the last one at rest.
    """
    from graspbench.simulation import World
    from graspbench.simulation.capture import capture

    model = load_object(config.object)
    with World(model, config.scene, config.seed) as world:
        views = capture(world, config.camera, config.stations, config.seed, config.silhouette)
    return list(reconstruct(find_silhouettes(views, config.silhouette), config.surface))


def _load(config: TrialConfig, checker: GraspChecker, clock: StageClock) -> ObjectModel:
    """Load the object, if the hand can span it."""
    with clock.stage("object"):
        model = load_object(config.object)
        _check_size(model, checker)
    return model


def _photograph(
    config: TrialConfig, model: ObjectModel, clock: StageClock, stack: ExitStack
) -> tuple[Scene, tuple[View, ...]]:
    """Put the object on the table and take images of it from all stations."""
    from graspbench.simulation import World
    from graspbench.simulation.capture import capture

    with clock.stage("scene"):
        world = stack.enter_context(World(model, config.scene, config.seed))
    with clock.stage("images"):
        views = capture(world, config.camera, config.stations, config.seed, config.silhouette)
    return Scene(world, model, world.transform_object_to_world), views


def _check_size(model: ObjectModel, checker: GraspChecker) -> None:
    """Refuse an object that no posture of the hand can span, before any image is taken."""
    width = smallest_width(np.asarray(model.mesh.vertices)) + 2 * checker.hand.tip_radius_m
    if width > checker.pair_limit_m:
        raise HandError(
            f"the object '{model.name}' with a fingertip on each side is {1e3 * width:.0f} mm wide where it "
            f"is narrowest, the hand '{checker.hand.name}' spans {1e3 * checker.pair_limit_m:.0f} mm",
            remedy="take a larger hand or a smaller object.scale",
            width_m=width,
            span_m=checker.pair_limit_m,
        )
