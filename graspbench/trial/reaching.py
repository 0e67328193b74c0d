"""The way to the grasp, and what carries the hand there: base and grasp are chosen together."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from graspbench.config.trial_config import TrialConfig
from graspbench.errors import PlanningError, SimulationError
from graspbench.planning import FingertipPath, JointPath, Plan, clear_approach
from graspbench.simulation.mounts.arm_model import carrying_arms
from graspbench.simulation.mounts.arm_placement import place_arm
from graspbench.simulation.mounts.choice import Carrier
from graspbench.simulation.phases import palm_task, plan_phases
from graspbench.trial.clock import StageClock
from graspbench.trial.planned import PlannedTrial
from graspbench.trial.strengthening import Strengthened, carries_object, strengthened

MAX_TRIED = 16
"""So many more of the planner's grasps are tried when no way leads to any of them."""


@dataclass(frozen=True, eq=False)
class Way:
    """What is executed, how, and by what.

    Attributes:
        trial: The trial; its `executed` is the grasp that the way leads to.
        paths: The fingertips' paths.
        motion: The hand's motion along them.
        carrier: What carries the hand: the arm where it stands, or what stands to be placed.
    """

    trial: PlannedTrial
    paths: tuple[FingertipPath, ...]
    motion: JointPath
    carrier: Carrier


def way_to_grasp(config: TrialConfig, trial: PlannedTrial, clock: StageClock) -> Way:
    """Plan the way to the grasp that is executed; where none leads there, to the next best of the planner's.

    With an arm, its place is looked for around the object, for the whole of the task: approach, lift, turn
    and shakes. Where the fingers find no way to the grasp, or the arm reaches it from no place, the next best
    of the planner's grasps that carries the object takes the grasp's place. An object that moves is left to
    the execution: its task is known only then.

    Args:
        config: What to run.
        trial: Up to its plan, strengthened if need be.
        clock: Times the stages.

    Raises:
        PlanningError: The hand cannot follow any way to its grasp.
        SimulationError: The arm reaches none of the grasps from any place.
    """
    executed = trial.scene is not None and trial.followed is None and config.execution.until != "off"
    refused: PlanningError | SimulationError
    try:
        way = Way(trial, *clock.run("paths", partial(_approach, config, trial)), config.arm)
    except PlanningError as error:
        if not executed:
            raise
        refused = error
    else:
        if not executed or config.arm.urdf is None:
            return way
        try:
            with clock.stage("arm_placement"):
                return _placed(config, way)
        except SimulationError as error:
            refused = error
    with clock.stage("other_grasps"):
        return _to_another(config, trial, refused)


def _to_another(config: TrialConfig, trial: PlannedTrial, refused: PlanningError | SimulationError) -> Way:
    tried = 1
    for timed in sorted(trial.plan.found, key=lambda timed: -timed.found.score):
        found = timed.found
        if tried > MAX_TRIED:
            break
        if found.grasp is trial.executed.grasp or not carries_object(config, trial, found.grasp):
            continue
        tried += 1
        history = (*found.history, found.grasp)
        plan = replace(trial.plan, grasp=found.grasp, history=history, quality=timed.quality)
        try:
            return _instead(config, trial, plan)
        except (PlanningError, SimulationError):
            continue
    if tried == 1:
        raise refused
    raise type(refused)(
        f"{refused.what}, nor is there a way to {tried - 1} more of the grasps that were planned",
        remedy=refused.remedy,
        **refused.data | {"tried": tried},
    ) from refused


def _instead(config: TrialConfig, trial: PlannedTrial, plan: Plan) -> Way:
    """Return the way to another of the planner's grasps, which is strengthened as the first one would be."""
    other = strengthened(config, replace(trial, plan=plan, strengthened=None, explored=None), StageClock())
    executed = other.strengthened or Strengthened(plan.grasp, plan.history, plan.quality, False, False)
    taken = replace(trial, strengthened=replace(executed, for_way=True), explored=None)
    way = Way(taken, *_approach(config, taken), config.arm)
    return way if config.arm.urdf is None else _placed(config, way)


def _approach(config: TrialConfig, trial: PlannedTrial) -> tuple[tuple[FingertipPath, ...], JointPath]:
    return clear_approach(
        trial.executed.history, trial.surfaces[-1], trial.hand, config.planner, trial.checker.ground_height_m
    )


def _placed(config: TrialConfig, way: Way) -> Way:
    """Return the way with the arm where it can do all of it; raise SimulationError where there is no such."""
    scene, motion = way.trial.scene, way.motion
    assert scene is not None, "what is executed was simulated"
    palms = motion.transform_palm_to_world
    centre = np.asarray(scene.world.object_pose()[:3, 3])
    task = palm_task(motion.times, palms, centre, config.execution, plan_phases)
    arms = carrying_arms(config.arm, way.trial.hand, task.grasping)
    return replace(way, carrier=place_arm(arms, task))
