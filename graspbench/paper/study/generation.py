"""Grasps of the study made and tried in physics, one object after the other."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import GraspbenchError
from graspbench.geometry import ObjectModel, load_object
from graspbench.grasp.configuration import Grasp
from graspbench.hand import GraspChecker, load_hand
from graspbench.paper.study.cases import HANDS, SETTINGS, Case, case
from graspbench.paper.study.predictors import predictors
from graspbench.paper.study.sampling import stratified_grasps
from graspbench.planning import clear_approach, make_index
from graspbench.planning.planner import PlanningProblem
from graspbench.reconstruction.surface import Surface
from graspbench.simulation.graded_disturbances import GradedResult, execute_graded, quick
from graspbench.simulation.tip_friction import tip_friction
from graspbench.simulation.world import World

Row = dict[str, Any]


def rows_of_case(number: int) -> Iterator[Row]:
    """Yield a row for every grasp tried on one object with each hand; none where the object cannot be used.

    Args:
        number: Of the case; see `graspbench.paper.study.cases.case`.
    """
    from graspbench.trial.planned import reconstructed

    chosen = case(number)
    try:
        base = load_config(_overrides(chosen, "radial"))
        model, surfaces = load_object(base.object), reconstructed(base)
    except GraspbenchError:
        return
    for hand in HANDS:
        try:
            yield from _rows_of_hand(chosen, hand, model, surfaces)
        except GraspbenchError:
            continue


def _overrides(chosen: Case, hand: str) -> list[str]:
    return [
        *SETTINGS,
        *chosen.overrides,
        *HANDS[hand],
        f"quality.friction={chosen.friction:g}",
        f"object.mass_kg={chosen.mass_kg:g}",
        f"seed={chosen.number}",
    ]


def _rows_of_hand(chosen: Case, hand: str, model: ObjectModel, surfaces: list[Surface]) -> Iterator[Row]:
    config, surface = load_config(_overrides(chosen, hand)), surfaces[-1]
    checker = GraspChecker(load_hand(config.hand), 0.0 if config.surface.ground else None)
    checker.set_object(surface.points, surface.network.faces)
    n_f = config.hand.fingers
    index = make_index(config.index_name, config.index, n_f, config.quality)
    problem = PlanningProblem(surfaces, checker, n_f, index, config.quality, chosen.number)
    for stratum, grasp in stratified_grasps(problem, surface, surfaces, chosen.rng(hand)):
        outcome = _tried(config, model, checker, surface, grasp)
        if outcome is None:
            continue
        yield {
            "case": chosen.number,
            "object": chosen.object,
            "hand": hand,
            "stratum": stratum,
            "friction": chosen.friction,
            "mass_kg": chosen.mass_kg,
            **predictors(grasp, surface, checker.hand, config.quality),
            "held": outcome.held,
            "reason": outcome.reason,
            "forces_weight": outcome.forces_weight.astype(np.float32),
            "torques_weight": outcome.torques_weight.astype(np.float32),
            "grip_force_n": outcome.grip_force_n,
            "contact_error_m": outcome.contact_error_m,
            "torque_length_m": config.quality.torque_length_m(surface.points, surface.centroid),
            "points": (grasp.points - surface.centroid).astype(np.float32).ravel(),
            "normals": grasp.normals.astype(np.float32).ravel(),
        }


def _tried(
    config: TrialConfig, model: ObjectModel, checker: GraspChecker, surface: Surface, grasp: Grasp
) -> GradedResult | None:
    """Return what a grasp withstood; None where no path leads to it, or physics fails."""
    parameters = quick(config.execution)
    lever_m = config.quality.torque_length_m(surface.points, surface.centroid)
    friction = tip_friction(config.execution, config.quality, surface)
    try:
        _, motion = clear_approach((grasp,), surface, checker.hand, config.planner, checker.ground_height_m)
        with World(model, config.scene, config.seed) as world:
            return execute_graded(world, checker.hand, grasp, motion, parameters, friction, lever_m)
    except GraspbenchError:
        return None
