"""What is known of a trial before it runs."""

from graspbench.config.trial_config import TrialConfig
from graspbench.errors import GraspbenchError
from graspbench.geometry import object_name
from graspbench.results.migrations import SCHEMA_VERSION
from graspbench.results.trial_result import HandResult, ObjectResult, TrialResult


def started_result(config: TrialConfig) -> TrialResult:
    """Return the result of a trial that is done, before anything came of it."""
    tree = config.as_tree()
    return TrialResult(
        trial_id=config.trial_id,
        status="done",
        seed=config.seed,
        kind=config.kind,
        schema=SCHEMA_VERSION,
        choice=dict(config.choice),
        overridden=config.overridden,
        config=tree,
        object=ObjectResult(_object_name(config)),
        hand=HandResult(str(tree["hand"]["name"]), int(tree["hand"]["fingers"])),
        index=tree["index"],
    )


def _object_name(config: TrialConfig) -> str:
    """Return what the object is called even if it turns out that it cannot be loaded."""
    try:
        return object_name(config.object)
    except (GraspbenchError, OSError):
        return config.object.name


def executes(config: TrialConfig) -> bool:
    """Tell whether a trial is to end in physics, so that success can be asked of it."""
    if config.kind == "manipulation":
        return True  # a motion that is not as asked is no success, played in physics or not
    return config.execution.until != "off" and config.scene.source == "simulation"
