"""Trials: their configuration, their course, their results on disk, and grids of them.

Names are imported on first use, so that a command that only reads results does not load the simulator.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graspbench.experiment.catalogue import describe_hands, describe_objects
    from graspbench.experiment.compose import compose_tree, expand_sweep, group_options
    from graspbench.experiment.config import (
        ManipulationConfig,
        TrialConfig,
        config_from_tree,
        load_config,
        load_manipulation_config,
        manipulation_config_from_tree,
    )
    from graspbench.experiment.engine import EngineParameters, load_engine, split_engine
    from graspbench.experiment.manipulation import manipulate_and_store
    from graspbench.experiment.objects import check_object, repair_object, show_object
    from graspbench.experiment.runner import run_and_store
    from graspbench.experiment.store import ResultStore, load_results, results_frame, to_json
    from graspbench.experiment.sweep import PlannedTrial, SweepOptions, plan_sweep, run_sweep
    from graspbench.experiment.trial import run_trial

_HOMES = {
    "EngineParameters": "engine",
    "ManipulationConfig": "config",
    "PlannedTrial": "sweep",
    "ResultStore": "store",
    "SweepOptions": "sweep",
    "TrialConfig": "config",
    "check_object": "objects",
    "compose_tree": "compose",
    "config_from_tree": "config",
    "describe_hands": "catalogue",
    "describe_objects": "catalogue",
    "expand_sweep": "compose",
    "group_options": "compose",
    "load_config": "config",
    "load_engine": "engine",
    "load_manipulation_config": "config",
    "load_results": "store",
    "manipulate_and_store": "manipulation",
    "manipulation_config_from_tree": "config",
    "plan_sweep": "sweep",
    "repair_object": "objects",
    "results_frame": "store",
    "run_and_store": "runner",
    "run_sweep": "sweep",
    "run_trial": "trial",
    "show_object": "objects",
    "split_engine": "engine",
    "to_json": "store",
}

__all__ = [
    "EngineParameters",
    "ManipulationConfig",
    "PlannedTrial",
    "ResultStore",
    "SweepOptions",
    "TrialConfig",
    "check_object",
    "compose_tree",
    "config_from_tree",
    "describe_hands",
    "describe_objects",
    "expand_sweep",
    "group_options",
    "load_config",
    "load_engine",
    "load_manipulation_config",
    "load_results",
    "manipulate_and_store",
    "manipulation_config_from_tree",
    "plan_sweep",
    "repair_object",
    "results_frame",
    "run_and_store",
    "run_sweep",
    "run_trial",
    "show_object",
    "split_engine",
    "to_json",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
