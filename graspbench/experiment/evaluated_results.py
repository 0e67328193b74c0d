"""Planners beside each other: the grasps of a results folder, judged and tried by every protocol alike."""

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.config.engine import check_jobs
from graspbench.config.protocols import EvaluationParameters, load_evaluation, split_evaluation
from graspbench.errors import ConfigurationError, InputError
from graspbench.evaluation.table import kendall_between
from graspbench.experiment.evaluation import EvaluateOptions, Evaluation, scale_of, stated
from graspbench.experiment.evaluation_table import protocol_table
from graspbench.experiment.evaluation_work import EvaluationWork, evaluated_portions, split_work
from graspbench.experiment.export import grasp_sets
from graspbench.report.statistics import wilson_interval
from graspbench.results.plain import as_plain
from graspbench.results.store import load_results, write_atomically
from graspbench.results.trial_result import TrialResult

ROWS_FILE = "rows.jsonl"
PLANNER_KEYS = ("planner", "hand", "object", "trial")


def evaluate_results(
    folder: Path,
    options: EvaluateOptions,
    output: Path | None = None,
    on_grasp: Callable[[int, int], None] = lambda done, of: None,
) -> Evaluation:
    """Judge and try the planned grasps of a results folder; a trial without a grasp is no success.

    Args:
        folder: Of a sweep over planners, hands, objects.
        options: How; hand and object are those of the trials.
        output: Where rows are kept as they are found; what is there is gone on with.
        on_grasp: Called with the trials done and all of them.

    Raises:
        InputError: No trial was finished.
        ConfigurationError: An option is unknown, or rows are there that were made with others.
    """
    ours, others = split_evaluation(options.overrides)
    if others:
        raise ConfigurationError(
            f"'{others[0]}' is the trials' to say, not the evaluation's",
            remedy="leave it out; protocol, judge and stand can be set",
        )
    parameters = load_evaluation(ours, options.config_dir)
    results = [result for result in load_results([folder]).results if result.status in ("done", "failed")]
    if not results:
        raise InputError(
            f"{folder} holds no finished trial", remedy="plan first: graspbench sweep planner=..."
        )
    about = {
        "protocols": {name: stated(each) for name, each in parameters.protocols.items()},
        "judge": dataclasses.asdict(parameters.judge),
        "stand": dataclasses.asdict(parameters.stand),
        "seed": options.seed,
    }
    check_jobs(options.jobs)
    rows = _kept(output, about)
    known = {row["trial"] for row in rows}
    with_grasp: set[str] = set()
    work: list[EvaluationWork] = []
    trials: list[list[TrialResult]] = []
    for config, found in grasp_sets([folder]):
        with_grasp |= {result.trial_id for result, _ in found}
        scale = scale_of(config.object)
        records = [dataclasses.replace(record, object_scale=scale) for _, record in found]
        for portion in split_work(records, config, parameters, options.seed):
            of_portion = [found[i][0] for i in portion.numbers]
            # A portion is tried whole, so that outcomes do not depend on what was kept.
            if any(result.trial_id not in known for result in of_portion):
                work.append(portion)
                trials.append(of_portion)
    anew = {result.trial_id for of_portion in trials for result in of_portion}
    rows = [row for row in rows if row["trial"] not in anew]
    on_grasp(len(rows), len(results))
    for of_portion, evaluated in zip(trials, evaluated_portions(work, options.jobs), strict=True):
        rows += [_names(result) | row for result, row in zip(of_portion, evaluated, strict=True)]
        _keep(output, about, rows)
        on_grasp(len(rows), len(results))
    known = {row["trial"] for row in rows} | with_grasp
    rows += [_without_grasp(result, parameters) for result in results if result.trial_id not in known]
    rows.sort(key=lambda row: [str(row[key]) for key in PLANNER_KEYS])
    for number, row in enumerate(rows):
        row["grasp"] = number
    evaluation = Evaluation(
        {"grasps": str(folder), "hand": "any", "object": "any", "count": len(rows)} | about, rows
    )
    evaluation.protocols = protocol_table(rows, parameters)
    evaluation.planners = planner_table(rows, tuple(parameters.protocols))
    evaluation.ranks = planner_ranks(rows, tuple(parameters.protocols))
    return evaluation


def planner_table(rows: Sequence[Mapping[str, Any]], protocols: Sequence[str]) -> list[dict[str, Any]]:
    """Return a row a planner: trials that gave a grasp, and successes with Wilson's interval."""
    table = []
    for planner in sorted({row["planner"] for row in rows}):
        own = [row for row in rows if row["planner"] == planner]
        line: dict[str, Any] = {
            "planner": planner,
            "trials": len(own),
            "grasps": sum(row["status"] == "done" for row in own),
        }
        for name in ("sound", "force_closure"):
            line |= _rate(name, [bool(row[name]) for row in own])
        for name in protocols:
            line |= _rate(name, [bool(row["protocols"].get(name, {}).get("success")) for row in own])
        table.append(line)
    return table


def planner_ranks(rows: Sequence[Mapping[str, Any]], protocols: Sequence[str]) -> list[dict[str, Any]]:
    """Return Kendall's tau and the inversions between the orders in which two protocols put the planners."""
    table = planner_table(rows, protocols)
    return kendall_between({name: np.array([row[name] for row in table], dtype=float) for name in protocols})


def _rate(name: str, successes: Sequence[bool]) -> dict[str, float]:
    rate = wilson_interval(sum(successes), len(successes))
    return {name: rate.value, f"{name}.low": rate.low, f"{name}.high": rate.high}


def _names(result: TrialResult) -> dict[str, Any]:
    chosen = result.choice.get("planner", "default")
    return {
        "planner": "parallel" if chosen == "default" else chosen,
        "hand": result.hand.name,
        "object": result.object.name,
        "trial": result.trial_id,
    }


def _without_grasp(result: TrialResult, parameters: EvaluationParameters) -> dict[str, Any]:
    nothing = {"success": False, "value": 0.0, "reason": "no grasp was planned"}
    return _names(result) | {
        "status": "none",
        "reason": result.reason,
        "contacts": 0,
        "fingers": 0,
        "depth_mm": None,
        "sound": False,
        "violations": [],
        "force_closure": False,
        "measures": {},
        "protocols": {name: dict(nothing) for name in parameters.protocols},
    }


def _kept(output: Path | None, about: Mapping[str, Any]) -> list[dict[str, Any]]:
    path = None if output is None else output / ROWS_FILE
    if path is None or not path.is_file():
        return []
    first, *rows = (json.loads(line) for line in path.read_text(encoding="utf-8").splitlines())
    if first != as_plain(dict(about)):
        raise ConfigurationError(
            f"{path} was made with other options",
            remedy="choose another --output, or the options it was made with",
        )
    return list(rows)


def _keep(output: Path | None, about: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> None:
    if output is not None:
        lines = [dict(about), *map(dict, rows)]
        text = "".join(json.dumps(as_plain(line), allow_nan=False) + "\n" for line in lines)
        write_atomically(output / ROWS_FILE, text)
