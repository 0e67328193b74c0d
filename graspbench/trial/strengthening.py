"""A stronger grasp in place of the planned one, where that would hardly hold.

The planner sees no mass and climbs an index that knows no friction, so its grasp may be too weak for the
object's weight, or keep its contacts only just. Before such a grasp is executed the planner plans again for a
hand that carries the object, and the grasp climbs Q3 under the hand's constraints. The planner's own grasp
stays what it is in every comparison of planners.
"""

from contextlib import suppress
from dataclasses import dataclass, replace

from graspbench.arrays import FloatArray
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.contact import WITH_TORSION
from graspbench.grasp.internal_forces import friction_reserve
from graspbench.grasp.quality import GraspQuality
from graspbench.hand.posture import HandPosture
from graspbench.planning import (
    Plan,
    PlanningProblem,
    make_index,
    make_planner,
    plan_with,
    refine,
)
from graspbench.planning.constraint import HandConstraint
from graspbench.planning.loaded_hand import LoadedHand
from graspbench.planning.merit import quality_of
from graspbench.planning.payload import carries, payload_n
from graspbench.trial.clock import StageClock
from graspbench.trial.planned import PlannedTrial

MARGIN = 4 / 3
"""Times the wanted weight that a grasp carries where one can be found that does."""


EASE = 5.0
"""Times an object's weight that the hand carries with ease; of heavier ones contacts on rims lose hold."""


@dataclass(frozen=True, eq=False)
class Strengthened:
    """A grasp that is executed in place of the planned one.

    Attributes:
        grasp: The grasp.
        history: Configurations that led to it, the grasp last.
        quality: Its Q1, Q2 and Q3.
        for_weight: Whether it was planned again, because the first grasp was too weak for the object.
        climbed: Whether it climbed Q3.
        for_way: Whether it was taken because no way leads to the planned grasp, or no arm reaches it.
        for_gait: Whether it was taken because the planned grasp has no gait.
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    quality: GraspQuality
    for_weight: bool
    climbed: bool
    for_way: bool = False
    for_gait: bool = False


def strengthened(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> PlannedTrial:
    """Put a stronger grasp in place of a weak one that is to lift the object.

    Args:
        config: What to run.
        trial: Up to its plan.
        clock: Times the stages, where there are any.

    Raises:
        PlanningError: Neither the planned grasp nor another one that was found carries the object.
    """
    lifts = config.execution.until not in ("off", "contact")
    if trial.scene is None or trial.plan.grasp.posture is None or not lifts:
        return trial
    plan, hand = _for_weight(config, trial, clock)
    grasp, history = plan.grasp, plan.history
    if _barely_holds(config, trial, plan):
        grasp = clock.run("strengthening", lambda: _climbed(config, trial, grasp, hand))
        history = plan.history if grasp is plan.grasp else (*plan.history, grasp)
    if grasp is trial.plan.grasp:
        return trial
    measured = measured_on_surface(config, trial, grasp)
    instead = Strengthened(grasp, history, measured, plan is not trial.plan, grasp is not plan.grasp)
    return replace(trial, strengthened=instead)


def measured_on_surface(config: TrialConfig, trial: PlannedTrial, grasp: Grasp) -> GraspQuality:
    """Return the measures of a grasp on the finished surface."""
    surface, quality = trial.surfaces[-1], config.quality
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    return quality_of(surface, grasp.vertices, quality, length_m)


def carries_object(config: TrialConfig, trial: PlannedTrial, grasp: Grasp) -> bool:
    """Tell whether a grasp of the planner's carries the object, with the margin of one that is looked for."""
    safety = config.execution.payload_safety
    if safety == 0.0 or config.execution.until in ("off", "contact"):
        return True
    assert trial.scene is not None
    weight_n = trial.scene.model.mass_kg * config.scene.gravity
    return _Load(config, trial).is_carried(grasp, MARGIN * safety * weight_n)


def _for_weight(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> tuple[Plan, HandConstraint]:
    """Return a plan that carries the object, and the constraints that go on asking for it."""
    safety, gravity = config.execution.payload_safety, config.scene.gravity
    if safety == 0.0:
        return trial.plan, trial.checker
    assert trial.scene is not None
    load, mass_kg = _Load(config, trial), trial.scene.model.mass_kg
    planned_n, wanted_n = load.carried_n(trial.plan.grasp), safety * mass_kg * gravity

    def loaded(margin: float) -> LoadedHand:
        return LoadedHand(trial.checker, load.carried, margin * wanted_n)

    if planned_n >= MARGIN * wanted_n:
        return trial.plan, loaded(1.0)

    def plan_loaded(margin: float) -> Plan:
        problem = PlanningProblem(
            trial.surfaces,
            loaded(margin),
            config.hand.fingers,
            make_index(config.index_name, config.index, config.hand.fingers, config.quality),
            config.quality,
            config.seed,
            config.planner.time_limit_s,
        )
        return plan_with(make_planner(config.planner_name, config.planner), problem)

    def plan_anew() -> Plan:
        with suppress(PlanningError):
            return plan_loaded(MARGIN)
        return trial.plan if planned_n >= wanted_n else plan_loaded(1.0)

    try:
        return clock.run("planning_for_weight", plan_anew), loaded(1.0)
    except PlanningError as error:
        raise PlanningError(
            f"'{trial.name}' is too heavy for the hand '{trial.hand.name}': it weighs {mass_kg:.2f} kg, joint"
            f" torques and friction carry {planned_n / gravity:.2f} kg at best with the planned grasp;"
            f" {safety:g} times its weight is wanted, and no other grasp that was found carries that",
            remedy="take a stronger hand (hand.effort_limit_nm), more friction, or a "
            "lower execution.payload_safety",
            mass_kg=mass_kg,
            payload_kg=planned_n / gravity,
        ) from error


def _barely_holds(config: TrialConfig, trial: PlannedTrial, plan: Plan) -> bool:
    """Tell whether some contact has little friction left when the fingers squeeze, or Q3 is small."""
    execution, quality, grasp = config.execution, config.quality, plan.grasp
    if plan.quality.q3 < execution.strengthen_below_q3 and _carries_with_ease(config, trial, grasp):
        return True
    least = execution.strengthen_below
    if least == 0.0 or quality.contact == "frictionless":
        return False
    arms = grasp.points - trial.surfaces[-1].centroid
    return friction_reserve(arms, -grasp.normals, quality.friction, least) < least


def _carries_with_ease(config: TrialConfig, trial: PlannedTrial, grasp: Grasp) -> bool:
    assert trial.scene is not None
    weight_n = trial.scene.model.mass_kg * config.scene.gravity
    return _Load(config, trial).is_carried(grasp, EASE * weight_n)


def _climbed(config: TrialConfig, trial: PlannedTrial, grasp: Grasp, hand: HandConstraint) -> Grasp:
    """Return the grasp at a summit of Q3 that the hand holds, the given one where there is none higher."""
    try:
        found = refine(
            grasp, trial.surfaces[-1], "q3", config.quality, checker=hand, parameters=config.planner.refine
        )
    except PlanningError:
        return grasp  # a planner of somebody else's may use nodes that the climb cannot begin at
    return found.grasp if found.value > found.start_value else grasp


class _Load:
    """What tells the weight that the hand carries with contacts on the finished surface."""

    def __init__(self, config: TrialConfig, trial: PlannedTrial) -> None:
        quality, surface = config.quality, trial.surfaces[-1]
        length_m = quality.torque_length_m(surface.points, surface.centroid)
        torsion_m = quality.torsion(length_m) * length_m if quality.contact in WITH_TORSION else 0.0
        self._hand, self._given = trial.hand, (surface.centroid, quality.friction, torsion_m)

    def carried(self, posture: HandPosture, points: FloatArray, normals: FloatArray, weight_n: float) -> bool:
        """Tell whether a posture with contacts and outward normals, shape (n_f, 3) each, carries a weight."""
        return carries(self._hand, posture, points, -normals, *self._given, weight_n)

    def is_carried(self, grasp: Grasp, weight_n: float) -> bool:
        """Tell whether a grasp carries a weight."""
        assert grasp.posture is not None
        return self.carried(grasp.posture, grasp.points, grasp.normals, weight_n)

    def carried_n(self, grasp: Grasp) -> float:
        """Return the largest weight that a grasp carries, N."""
        assert grasp.posture is not None
        return payload_n(self._hand, grasp.posture, grasp.points, -grasp.normals, *self._given)
