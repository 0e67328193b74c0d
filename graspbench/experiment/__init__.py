"""Trials: their configuration, their course, their results on disk, and grids of them.

Names are imported on first use, so that a command that only reads results does not load the simulator.
"""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
    from graspbench.config.compose import compose_tree
    from graspbench.config.engine import EngineParameters, load_engine, split_engine
    from graspbench.config.grid import expand_sweep
    from graspbench.config.groups import group_options
    from graspbench.config.trial_config import (
        ManipulationConfig,
        TrialConfig,
        config_from_tree,
        load_config,
        load_manipulation_config,
        load_one_config,
        load_stored_config,
        manipulation_config_from_tree,
    )
    from graspbench.evaluation.formats.format import describe_formats
    from graspbench.experiment.arms import add_arm, describe_arms
    from graspbench.experiment.catalogue import describe_hands, describe_objects
    from graspbench.experiment.evaluated_results import evaluate_results
    from graspbench.experiment.evaluation import EvaluateOptions, Evaluation, evaluate_file, evaluate_records
    from graspbench.experiment.export import export_results
    from graspbench.experiment.hand_check import check_hand
    from graspbench.experiment.hands import add_hand, show_hand
    from graspbench.experiment.objects import check_object, repair_object, show_object
    from graspbench.results.columns import describe_column, results_frame
    from graspbench.results.plain import to_json
    from graspbench.results.store import LoadedResults, ResultStore, load_results
    from graspbench.results.trial_result import TrialResult
    from graspbench.sweep.grid import SweepOptions, SweepTrial, plan_sweep, run_sweep
    from graspbench.trial.clock import Watch
    from graspbench.trial.runner import run_and_store, run_trial

_HOMES = {
    "EngineParameters": ".config.engine",
    "EvaluateOptions": "evaluation",
    "Evaluation": "evaluation",
    "LoadedResults": ".results.store",
    "ManipulationConfig": ".config.trial_config",
    "ResultStore": ".results.store",
    "SweepOptions": ".sweep.grid",
    "SweepTrial": ".sweep.grid",
    "TrialConfig": ".config.trial_config",
    "TrialResult": ".results.trial_result",
    "Watch": ".trial.clock",
    "add_arm": "arms",
    "add_hand": "hands",
    "check_hand": "hand_check",
    "check_object": "objects",
    "compose_tree": ".config.compose",
    "config_from_tree": ".config.trial_config",
    "describe_arms": "arms",
    "describe_column": ".results.columns",
    "describe_formats": ".evaluation.formats.format",
    "describe_hands": "catalogue",
    "describe_objects": "catalogue",
    "evaluate_file": "evaluation",
    "evaluate_records": "evaluation",
    "evaluate_results": "evaluated_results",
    "expand_sweep": ".config.grid",
    "export_results": "export",
    "group_options": ".config.groups",
    "load_config": ".config.trial_config",
    "load_engine": ".config.engine",
    "load_manipulation_config": ".config.trial_config",
    "load_one_config": ".config.trial_config",
    "load_results": ".results.store",
    "load_stored_config": ".config.trial_config",
    "manipulation_config_from_tree": ".config.trial_config",
    "plan_sweep": ".sweep.grid",
    "repair_object": "objects",
    "results_frame": ".results.columns",
    "run_and_store": ".trial.runner",
    "run_sweep": ".sweep.grid",
    "run_trial": ".trial.runner",
    "show_hand": "hands",
    "show_object": "objects",
    "split_engine": ".config.engine",
    "to_json": ".results.plain",
}

__all__ = [
    "EngineParameters",
    "EvaluateOptions",
    "Evaluation",
    "LoadedResults",
    "ManipulationConfig",
    "ResultStore",
    "SweepOptions",
    "SweepTrial",
    "TrialConfig",
    "TrialResult",
    "Watch",
    "add_arm",
    "add_hand",
    "check_hand",
    "check_object",
    "compose_tree",
    "config_from_tree",
    "describe_arms",
    "describe_column",
    "describe_formats",
    "describe_hands",
    "describe_objects",
    "evaluate_file",
    "evaluate_records",
    "evaluate_results",
    "expand_sweep",
    "export_results",
    "group_options",
    "load_config",
    "load_engine",
    "load_manipulation_config",
    "load_one_config",
    "load_results",
    "load_stored_config",
    "manipulation_config_from_tree",
    "plan_sweep",
    "repair_object",
    "results_frame",
    "run_and_store",
    "run_sweep",
    "run_trial",
    "show_hand",
    "show_object",
    "split_engine",
    "to_json",
]

__getattr__ = loads_on_use(__name__, _HOMES)
