"""The grasp that a gait starts from: the planned one, or another from which the fingers can turn the object.

How far fingers can turn an object is decided by where they stand at first, and no index of the planners asks
for that. So where the planned grasp has no gait others are tried, drawn at random as the planner
``random_closure`` draws them, the best by Q3 first. The planner's own grasp stays what it is in every
comparison of planners.
"""

from collections.abc import Iterator
from dataclasses import replace

from graspbench.config.trial_config import ManipulationConfig
from graspbench.errors import ManipulationError
from graspbench.grasp import Grasp
from graspbench.manipulation import ContactParameters, GaitResult, gait_object
from graspbench.planning import PlanningProblem, make_index
from graspbench.planning.planners.random_closure import RandomClosure, RandomClosureParameters
from graspbench.trial.planned import PlannedTrial
from graspbench.trial.strengthening import Strengthened, carries_object, measured_on_surface


def gait_with_start(
    config: ManipulationConfig, trial: PlannedTrial, contact: ContactParameters
) -> tuple[PlannedTrial, GaitResult]:
    """Plan a gait from the planned grasp, or from another one if that has none.

    Args:
        config: The gait, and how many other grasps may be tried: ``motion.gait.starts``.
        trial: Up to its plan.
        contact: Contact type and forces.

    Returns:
        The trial, with the grasp that the gait starts from as the one that is executed; and the gait.

    Raises:
        ManipulationError: No grasp that was tried has a gait; it tells of the one that turns farthest.
    """
    try:
        return trial, _gait(config, trial, trial.plan.grasp, contact)
    except ManipulationError as error:
        if "turned_deg" not in error.data:
            raise
        refused, tried = error, 1
    for start in _starts(config, trial):
        try:
            gait = _gait(config, trial, start, contact)
        except ManipulationError as error:
            tried += 1
            if error.data.get("turned_deg", 0.0) > refused.data["turned_deg"]:
                refused = error
        else:
            measured = measured_on_surface(config, trial, start)
            instead = Strengthened(start, (start,), measured, False, False, for_gait=True)
            return replace(trial, strengthened=instead), gait
    if tried == 1:
        raise refused
    raise ManipulationError(
        f"{refused.what}, by the best of {tried} grasps", remedy=refused.remedy, **refused.data
    ) from refused


def _gait(
    config: ManipulationConfig, trial: PlannedTrial, grasp: Grasp, contact: ContactParameters
) -> GaitResult:
    return gait_object(
        trial.hand,
        grasp,
        trial.surfaces[-1],
        config.motion.gait,
        config.clik,
        contact,
        gravity=config.scene.gravity,
    )


def _starts(config: ManipulationConfig, trial: PlannedTrial) -> Iterator[Grasp]:
    """Yield other grasps of the finished surface that the hand holds, the best by Q3 first."""
    if config.motion.gait.starts == 0:
        return
    problem = PlanningProblem(
        trial.surfaces,
        trial.checker,
        config.hand.fingers,
        make_index(config.index_name, config.index, config.hand.fingers, config.quality),
        config.quality,
        config.seed,
        config.planner.time_limit_s,
    )
    planner = RandomClosure(RandomClosureParameters(grasps=config.motion.gait.starts))
    for found in sorted(planner.plan(problem), key=lambda found: -found.score):
        if trial.scene is None or carries_object(config, trial, found.grasp):
            yield found.grasp
