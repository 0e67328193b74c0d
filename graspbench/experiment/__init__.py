"""Trials: their configuration, their course, their results on disk, and grids of them.

Names are imported on first use, so that a command that only reads results does not load the simulator.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from graspbench.config.compose import compose_tree, expand_sweep, group_options
    from graspbench.config.trial_config import (
        ManipulationConfig,
        TrialConfig,
        config_from_tree,
        load_config,
        load_manipulation_config,
        manipulation_config_from_tree,
    )
    from graspbench.experiment.catalogue import describe_hands, describe_objects
    from graspbench.experiment.objects import check_object, repair_object, show_object
    from graspbench.results.store import ResultStore, load_results, results_frame, to_json
    from graspbench.sweep.engine import EngineParameters, load_engine, split_engine
    from graspbench.sweep.grid import PlannedTrial, SweepOptions, plan_sweep, run_sweep
    from graspbench.trial.in_hand import manipulate_and_store
    from graspbench.trial.pipeline import run_trial
    from graspbench.trial.runner import run_and_store

_HOMES = {
    "EngineParameters": "sweep.engine",
    "ManipulationConfig": "config.trial_config",
    "PlannedTrial": "sweep.grid",
    "ResultStore": "results.store",
    "SweepOptions": "sweep.grid",
    "TrialConfig": "config.trial_config",
    "check_object": "experiment.objects",
    "compose_tree": "config.compose",
    "config_from_tree": "config.trial_config",
    "describe_hands": "experiment.catalogue",
    "describe_objects": "experiment.catalogue",
    "expand_sweep": "config.compose",
    "group_options": "config.compose",
    "load_config": "config.trial_config",
    "load_engine": "sweep.engine",
    "load_manipulation_config": "config.trial_config",
    "load_results": "results.store",
    "manipulate_and_store": "trial.in_hand",
    "manipulation_config_from_tree": "config.trial_config",
    "plan_sweep": "sweep.grid",
    "repair_object": "experiment.objects",
    "results_frame": "results.store",
    "run_and_store": "trial.runner",
    "run_sweep": "sweep.grid",
    "run_trial": "trial.pipeline",
    "show_object": "experiment.objects",
    "split_engine": "sweep.engine",
    "to_json": "results.store",
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
        return getattr(import_module(f"graspbench.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
