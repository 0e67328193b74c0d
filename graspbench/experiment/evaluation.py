"""Grasps of a file judged and tried, whoever planned them; our own grasps written for others."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.config.engine import check_jobs
from graspbench.config.protocols import EvaluationParameters, load_evaluation, split_evaluation
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import GraspbenchError
from graspbench.evaluation.faults import find_fault, refuse_fault
from graspbench.evaluation.formats.format import FormatContext, format_of, read_grasps
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.other_readings import combined_reading
from graspbench.evaluation.table import kendall_between
from graspbench.experiment.evaluation_table import protocol_table
from graspbench.experiment.evaluation_work import evaluated_portions, split_work
from graspbench.experiment.hand_and_object import hand_and_object
from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import load_hand

SCHEMA = 1


@dataclass(frozen=True)
class EvaluateOptions:
    """What a set of grasps is evaluated for.

    Attributes:
        hand: An option of the group ``hand``.
        object: An option of the group ``object``, or a mesh file.
        overrides: Options of hand, object, quality, protocol, judge and stand.
        config_dir: A user's folder with further groups and options.
        format: Format of the file; None finds out.
        read_as: How the file's numbers are meant, where its writer erred: xyzw, degrees, millimetres.
        as_it_is: Whether the file is taken as it is, whatever may be wrong with it.
        seed: Source of every random draw.
        jobs: Processes at a time; 0: in this process.
    """

    hand: str
    object: str
    overrides: Sequence[str] = ()
    config_dir: Path | None = None
    format: str | None = None
    read_as: Sequence[str] = ()
    as_it_is: bool = False
    seed: int = 0
    jobs: int = 0


@dataclass
class Evaluation:
    """What came of a set of grasps.

    Attributes:
        about: Which grasps, hand, object and options.
        rows: One a grasp.
        protocols: One row a protocol, and one for the judge: successes with intervals.
        planners: One row a planner, where several planned: successes by protocol with intervals.
        ranks: Kendall's tau between the protocols' values of the same grasps; where planners are compared,
            between the orders in which the protocols put them.
    """

    about: dict[str, Any]
    rows: list[dict[str, Any]]
    protocols: list[dict[str, Any]] = field(default_factory=list)
    planners: list[dict[str, Any]] = field(default_factory=list)
    ranks: list[dict[str, Any]] = field(default_factory=list)

    def as_tree(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {"schema": SCHEMA, **dataclasses.asdict(self)}


def evaluate_file(
    path: Path, options: EvaluateOptions, on_grasp: Callable[[int, int], None] = lambda done, of: None
) -> Evaluation:
    """Judge and try the grasps of a file or folder.

    Args:
        path: The file or folder.
        options: For which hand and object, and how.
        on_grasp: Called with the grasps done and all of them.

    Raises:
        GraspFileError: A file cannot be read, does not fit, or seems to be wrong; the sentence says how.
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    ours, others = split_evaluation(options.overrides)
    parameters = load_evaluation(ours, options.config_dir)
    config = hand_and_object(options.hand, options.object, others, options.config_dir)
    context = FormatContext(load_hand(config.hand), load_object(config.object), scale_of(config.object))
    context = dataclasses.replace(context, reading=combined_reading(options.read_as))
    records = read_grasps(path, context, options.format)
    if not options.as_it_is:
        for file, name in _files(path, options.format):
            found = records if file == path else read_grasps(file, context, name)
            if (fault := find_fault(file, found, context, name)) is not None:
                raise refuse_fault(fault, name)
    evaluation = evaluate_records(
        records, config, parameters, seed=options.seed, jobs=options.jobs, on_grasp=on_grasp
    )
    evaluation.about = {"grasps": str(path), **evaluation.about}
    return evaluation


def evaluate_records(
    records: Sequence[GraspRecord],
    config: TrialConfig,
    parameters: EvaluationParameters,
    *,
    seed: int = 0,
    jobs: int = 0,
    on_grasp: Callable[[int, int], None] = lambda done, of: None,
) -> Evaluation:
    """Judge and try grasps of one hand on one object, at the scales that the records say.

    Args:
        records: The grasps.
        config: Hand, object and quality count.
        parameters: Judge, stand and protocols.
        seed: Source of every random draw; each grasp draws its own.
        jobs: Processes at a time; 0: in this process.
        on_grasp: Called with the grasps done and all of them.
    """
    check_jobs(jobs)
    work = list(split_work(records, config, parameters, seed))
    rows: list[dict[str, Any]] = []
    for done in evaluated_portions(work, jobs):
        rows += done
        on_grasp(len(rows), len(records))
    rows.sort(key=lambda row: int(row["grasp"]))
    about = {
        "hand": config.hand.name,
        "object": config.object.mesh or config.object.name,
        "count": len(rows),
        "quality": config.quality.describe(),
        "protocols": {name: stated(each) for name, each in parameters.protocols.items()},
        "seed": seed,
    }
    evaluation = Evaluation(about, rows)
    evaluation.protocols = protocol_table(rows, parameters)
    values = {name: np.array([_value(row, name) for row in rows]) for name in parameters.protocols}
    evaluation.ranks = kendall_between(values)
    return evaluation


def _value(row: Mapping[str, Any], protocol: str) -> float:
    outcome = row["protocols"].get(protocol)
    return float("nan") if outcome is None else float(outcome["value"])


def _files(path: Path, name: str | None) -> list[tuple[Path, str]]:
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    known = []
    for file in files:
        try:
            known.append((file, name or format_of(file)))
        except GraspbenchError:
            if file == path:
                raise
    return known


def scale_of(parameters: ObjectParameters) -> float:
    """Return the metres per unit of an object's mesh, as far as they are stated."""
    return parameters.scale if isinstance(parameters.scale, float) else 1.0


def stated(protocol: Any) -> dict[str, Any]:
    """Return a protocol's kind and parameters as plain values."""
    return {"kind": type(protocol).__name__, **dataclasses.asdict(protocol)}
