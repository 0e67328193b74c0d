"""Grasps of a file judged and tried, whoever planned them; our own grasps written for others."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pebble import ProcessExpired, ProcessPool

from graspbench.config.engine import check_jobs
from graspbench.config.protocols import EvaluationParameters, load_evaluation, split_evaluation
from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import GraspbenchError, SimulationError
from graspbench.evaluation.faults import combined_reading, find_fault, refuse_fault
from graspbench.evaluation.formats.format import FormatContext, format_of, read_grasps
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.judge import Judge, Judgement
from graspbench.evaluation.table import bootstrap_interval, kendall_between
from graspbench.geometry import ObjectParameters, load_object
from graspbench.grasp import QualityParameters
from graspbench.hand import HandParameters, load_hand
from graspbench.report.statistics import wilson_interval
from graspbench.simulation.hold_stand import HoldStand

SCHEMA = 1
MAX_DEPTH_M = 0.001
_CHUNK = 20
_MESHES = (".obj", ".stl", ".ply", ".glb", ".off")


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


@dataclass(frozen=True)
class _Work:
    """Grasps of one object at one scale, for one process."""

    numbers: tuple[int, ...]
    records: tuple[GraspRecord, ...]
    hand: HandParameters
    object: ObjectParameters
    quality: QualityParameters
    parameters: EvaluationParameters
    seed: int


@dataclass
class Evaluation:
    """What came of a set of grasps.

    Attributes:
        about: Which grasps, hand, object and options.
        rows: One a grasp.
        protocols: One row a protocol, and one for the judge: successes with intervals.
        ranks: Kendall's tau between the protocols' values of the same grasps.
    """

    about: dict[str, Any]
    rows: list[dict[str, Any]]
    protocols: list[dict[str, Any]] = field(default_factory=list)
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
    context = FormatContext(load_hand(config.hand), load_object(config.object), _scale(config.object))
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
    work = list(_split(records, config, parameters, seed, _CHUNK if jobs else len(records)))
    rows: list[dict[str, Any]] = []
    for done in _in_processes(work, jobs) if jobs else map(_evaluate, work):
        rows += done
        on_grasp(len(rows), len(records))
    rows.sort(key=lambda row: int(row["grasp"]))
    about = {
        "hand": config.hand.name,
        "object": config.object.mesh or config.object.name,
        "count": len(rows),
        "quality": config.quality.describe(),
        "protocols": {name: _stated(each) for name, each in parameters.protocols.items()},
        "seed": seed,
    }
    evaluation = Evaluation(about, rows)
    evaluation.protocols = protocol_table(rows, parameters)
    values = {name: np.array([_value(row, name) for row in rows]) for name in parameters.protocols}
    evaluation.ranks = kendall_between(values)
    return evaluation


def hand_and_object(
    hand: str, object_name: str, overrides: Sequence[str], config_dir: Path | None
) -> TrialConfig:
    """Compose hand, object and quality; all fingers of the hand are used unless ``hand.fingers`` is set.

    Args:
        hand: An option of the group ``hand``.
        object_name: An option of the group ``object``, or a mesh file.
        overrides: Further options.
        config_dir: A user's folder with further groups and options.
    """
    is_mesh = Path(object_name).suffix.lower() in _MESHES
    chosen = f"object.mesh={_quoted(object_name)}" if is_mesh else f"object={object_name}"
    config = load_config(["record=off", f"hand={hand}", chosen, *overrides], config_dir)
    fingers = len(config.hand.chains)
    if config.hand.kind == "urdf" and not any(text.startswith("hand.fingers=") for text in overrides):
        config = dataclasses.replace(config, hand=dataclasses.replace(config.hand, fingers=fingers))
    return config


def protocol_table(
    rows: Sequence[Mapping[str, Any]], parameters: EvaluationParameters
) -> list[dict[str, Any]]:
    """Return successes by protocol with Wilson's interval, and mean values with the bootstrap's."""
    table = [
        _counted(
            "force_closure",
            "the closed hand's contacts resist any wrench",
            [bool(r["force_closure"]) for r in rows],
        ),
        _counted(
            "sound",
            f"joints within limits, no links overlap, at most {1e3 * MAX_DEPTH_M:g} mm in the object",
            [bool(row["sound"]) for row in rows],
        ),
    ]
    for name, protocol in parameters.protocols.items():
        outcomes = [row["protocols"][name] for row in rows if name in row["protocols"]]
        row = _counted(name, protocol.description, [bool(each["success"]) for each in outcomes])
        values = np.array([each["value"] for each in outcomes], dtype=np.float64)
        low, high = bootstrap_interval(values)
        mean = float(values.mean()) if len(values) else float("nan")
        row |= {"value": mean, "value_low": low, "value_high": high, "unit": protocol.unit}
        table.append(row)
    return table


def _counted(name: str, meaning: str, successes: Sequence[bool]) -> dict[str, Any]:
    rate = wilson_interval(sum(successes), len(successes))
    return {
        "protocol": name,
        "success": rate.value,
        "low": rate.low,
        "high": rate.high,
        "grasps": len(successes),
        "meaning": meaning,
    }


def _value(row: Mapping[str, Any], protocol: str) -> float:
    outcome = row["protocols"].get(protocol)
    return float("nan") if outcome is None else float(outcome["value"])


def _split(
    records: Sequence[GraspRecord],
    config: TrialConfig,
    parameters: EvaluationParameters,
    seed: int,
    size: int,
) -> Iterator[_Work]:
    scales: dict[float, list[int]] = {}
    for i, record in enumerate(records):
        scales.setdefault(record.object_scale, []).append(i)
    for scale, numbers in scales.items():
        for start in range(0, len(numbers), size):
            chunk = tuple(numbers[start : start + size])
            yield _Work(
                numbers=chunk,
                records=tuple(records[i] for i in chunk),
                hand=config.hand,
                object=dataclasses.replace(config.object, scale=scale),
                quality=config.quality,
                parameters=parameters,
                seed=seed,
            )


def _in_processes(work: Sequence[_Work], jobs: int) -> Iterator[list[dict[str, Any]]]:
    with ProcessPool(max_workers=jobs) as pool:
        for each, future in [(each, pool.schedule(_evaluate, args=(each,))) for each in work]:
            try:
                yield future.result()
            except ProcessExpired as error:
                reason = f"the process ended with code {error.exitcode}"
                yield [
                    _row(i, record, None, reason)
                    for i, record in zip(each.numbers, each.records, strict=True)
                ]


def _evaluate(work: _Work) -> list[dict[str, Any]]:
    hand, model = load_hand(work.hand), load_object(work.object)
    p = work.parameters
    judge = Judge(hand, model, p.judge, work.quality, stiffness_nm_rad=p.stand.stiffness_nm_rad)
    judged = judge.judge(work.records)
    rows = [
        _row(i, record, judgement)
        for i, record, judgement in zip(work.numbers, work.records, judged, strict=True)
    ]
    if not work.parameters.protocols:
        return rows
    with HoldStand(hand, model, work.parameters.stand) as stand:
        for row, record, judgement in zip(rows, work.records, judged, strict=True):
            if record.grasp is not None:
                row["protocols"] = _outcomes(stand, record, judgement, work, int(row["grasp"]))
    return rows


def _outcomes(
    stand: HoldStand, record: GraspRecord, judgement: Judgement, work: _Work, number: int
) -> dict[str, dict[str, Any]]:
    outcomes = {}
    for name, protocol in work.parameters.protocols.items():
        try:
            outcome = protocol.run(stand, record, judgement, work.seed + 7919 * number)
        except SimulationError as error:
            outcomes[name] = {"success": False, "value": 0.0, "reason": error.what}
            continue
        outcomes[name] = {
            "success": outcome.success,
            "value": outcome.value,
            "reason": outcome.reason,
            **outcome.details,
        }
    return outcomes


def _row(
    number: int, record: GraspRecord, judgement: Judgement | None, reason: str | None = None
) -> dict[str, Any]:
    row: dict[str, Any] = {
        "grasp": number,
        "source": record.source,
        "confidence": record.confidence,
        "object_scale": record.object_scale,
        "status": "done" if judgement is not None else "crashed",
        "reason": reason,
        "contacts": 0,
        "fingers": 0,
        "depth_mm": None,
        "sound": False,
        "violations": [],
        "force_closure": False,
        "measures": {},
        "protocols": {},
    }
    if judgement is None:
        return row
    with_hand = record.grasp is not None
    sound = with_hand and not judgement.violations and judgement.depth_m <= MAX_DEPTH_M
    return row | {
        "contacts": len(judgement.contacts.points),
        "fingers": len({finger for finger in judgement.fingers if finger >= 0}),
        "depth_mm": 1e3 * judgement.depth_m if with_hand else None,
        "sound": sound,
        "violations": list(judgement.violations),
        "force_closure": judgement.force_closure,
        "measures": dict(judgement.measures),
    }


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


def _scale(parameters: ObjectParameters) -> float:
    return parameters.scale if isinstance(parameters.scale, float) else 1.0


def _stated(protocol: Any) -> dict[str, Any]:
    return {"kind": type(protocol).__name__, **dataclasses.asdict(protocol)}


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
