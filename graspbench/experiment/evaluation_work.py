"""Grasps judged and tried in portions, in this process or in several: one row a grasp."""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

from pebble import ProcessExpired, ProcessPool

from graspbench.config.protocols import EvaluationParameters
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import SimulationError
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.judge import Judge, Judgement
from graspbench.experiment.evaluation_start import start_evaluation_workers
from graspbench.geometry import ObjectParameters, load_object
from graspbench.grasp import QualityParameters
from graspbench.hand import HandParameters, load_hand
from graspbench.simulation.hold_stand import HoldStand

PORTION = 20
"""Grasps that share a stand; the same with any number of processes, so that outcomes are the same too."""

MAX_DEPTH_M = 0.001
"""A hand deeper than this in the object is not sound."""


@dataclass(frozen=True)
class EvaluationWork:
    """Grasps of one object at one scale, for one process."""

    numbers: tuple[int, ...]
    records: tuple[GraspRecord, ...]
    hand: HandParameters
    object: ObjectParameters
    quality: QualityParameters
    parameters: EvaluationParameters
    seed: int


def split_work(
    records: Sequence[GraspRecord],
    config: TrialConfig,
    parameters: EvaluationParameters,
    seed: int,
    size: int = PORTION,
) -> Iterator[EvaluationWork]:
    """Split grasps into portions of one object at one scale, by the grasps alone.

    Args:
        records: The grasps.
        config: Hand, object and quality.
        parameters: Judge, stand and protocols.
        seed: Source of every random draw.
        size: Grasps of a portion at most.
    """
    scales: dict[float, list[int]] = {}
    for i, record in enumerate(records):
        scales.setdefault(record.object_scale, []).append(i)
    for scale, numbers in scales.items():
        for start in range(0, len(numbers), size):
            chunk = tuple(numbers[start : start + size])
            yield EvaluationWork(
                numbers=chunk,
                records=tuple(records[i] for i in chunk),
                hand=config.hand,
                object=dataclasses.replace(config.object, scale=scale),
                quality=config.quality,
                parameters=parameters,
                seed=seed,
            )


def evaluated_portions(work: Sequence[EvaluationWork], jobs: int) -> Iterator[list[dict[str, Any]]]:
    """Yield the rows of each portion in its turn.

    The grasps of a portion whose process dies are told as crashed; the others are not touched.

    Args:
        work: The portions.
        jobs: Processes at a time; 0: in this process.
    """
    return _in_processes(work, jobs) if jobs else map(evaluate_work, work)


def _in_processes(work: Sequence[EvaluationWork], jobs: int) -> Iterator[list[dict[str, Any]]]:
    start_evaluation_workers()
    with ProcessPool(max_workers=jobs, context=get_context("forkserver")) as pool:
        try:
            for each, future in [(each, pool.schedule(evaluate_work, args=(each,))) for each in work]:
                try:
                    yield future.result()
                except ProcessExpired as error:
                    reason = f"the process ended with code {error.exitcode}"
                    yield [
                        _row(i, record, None, reason)
                        for i, record in zip(each.numbers, each.records, strict=True)
                    ]
        except BaseException:  # workers do not hear Ctrl-C, and would do all that is left
            pool.stop()
            raise


def evaluate_work(work: EvaluationWork) -> list[dict[str, Any]]:
    """Judge and try the grasps of a portion; return a row for each."""
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
    stand: HoldStand, record: GraspRecord, judgement: Judgement, work: EvaluationWork, number: int
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
