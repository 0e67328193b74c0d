"""Grasps for what is too heavy for the first one."""

from contextlib import suppress
from dataclasses import replace

from graspbench.arrays import FloatArray
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import PlanningError
from graspbench.grasp.contact import WITH_TORSION
from graspbench.hand.posture import HandPosture
from graspbench.planning import Plan, PlanningProblem, make_index, make_planner, payload_n, plan_with
from graspbench.planning.loaded_hand import Carried, LoadedHand
from graspbench.trial.clock import StageClock
from graspbench.trial.planned import PlannedTrial

MARGIN = 4 / 3
"""Times the wanted weight that a grasp which is chosen for it carries, where one can be found."""


def planned_for_weight(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> PlannedTrial:
    """Plan again for a hand that carries the object, where the planned grasp is too weak to lift it.

    The planner sees no mass: this is what a robot does that feels that its first grasp cannot lift.

    Args:
        config: What to run.
        trial: Up to its plan.
        clock: Times the stage, when there is one.

    Returns:
        The trial; its plan is another one when the first is too weak.

    Raises:
        PlanningError: No grasp that carries it was found either.
    """
    safety, gravity = config.execution.payload_safety, config.scene.gravity
    lifts = config.execution.until not in ("off", "contact")
    grasp = trial.plan.grasp
    if trial.scene is None or grasp.posture is None or not lifts or safety == 0.0:
        return trial
    carried = _carried_weight(config, trial)
    mass_kg, planned_n = trial.scene.model.mass_kg, carried(grasp.posture, grasp.points, grasp.normals)
    wanted_n = safety * mass_kg * gravity
    if planned_n >= wanted_n:
        return trial

    def plan_loaded(margin: float) -> Plan:
        problem = PlanningProblem(
            trial.surfaces,
            LoadedHand(trial.checker, carried, margin * wanted_n),
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
        return plan_loaded(1.0)

    try:
        return replace(trial, for_weight=True, plan=clock.run("planning_for_weight", plan_anew))
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


def _carried_weight(config: TrialConfig, trial: PlannedTrial) -> Carried:
    """Return what tells the weight that the hand carries with contacts on the finished surface."""
    quality, surface = config.quality, trial.surfaces[-1]
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    torsion_m = quality.torsion(length_m) * length_m if quality.contact in WITH_TORSION else 0.0

    def carried(posture: HandPosture, points: FloatArray, normals: FloatArray) -> float:
        centre = surface.centroid
        return payload_n(trial.hand, posture, points, -normals, centre, quality.friction, torsion_m)

    return carried
