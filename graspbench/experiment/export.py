"""Grasps of trials, written for other benchmarks."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.config.schema import renewed
from graspbench.config.trial_config import TrialConfig, config_from_tree
from graspbench.errors import InputError
from graspbench.evaluation.formats.format import FORMATS, FormatContext, write_grasps
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.judge import Judge
from graspbench.evaluation.records import record_of_posture
from graspbench.geometry import load_object
from graspbench.hand import load_hand
from graspbench.results.grasp_results import GraspResult
from graspbench.results.store import load_results
from graspbench.results.trial_result import TrialResult
from graspbench.simulation.world import World

_NO_FILE_NAME = re.compile(r"[^\w-]")
_MAX_NAME = 100
WHICH = ("local", "restarted", "global", "refined", "all")


def export_results(
    folders: list[Path], name: str, target: Path, which: str = "local"
) -> list[dict[str, object]]:
    """Write the planned grasps of trials in a format; one file for each hand and object.

    Where the object rests is found by letting it fall again, as in the trial. Pregrasp and squeeze are made
    up as the judge does.

    Args:
        folders: Results folders.
        name: The format.
        target: The file where all grasps are of one hand and object, else a folder.
        which: Which grasps of a trial.

    Returns:
        A row a file: path, format, hand, object, grasps.

    Raises:
        InputError: There is no grasp to write.
        OutputError: A file cannot be written.
    """
    written = FORMATS[name]  # an unknown format is refused before anything is read
    sets = [(config, [record for _, record in found]) for config, found in grasp_sets(folders, which)]
    if not sets:
        raise InputError(
            f"none of the trials has a grasp with a hand ({which})",
            remedy="give results of planned trials of simulated objects, or another --which",
        )
    rows = []
    for i, (config, records) in enumerate(sets):
        hand, model = load_hand(config.hand), load_object(config.object)
        judge = Judge(hand, model, measures=())
        scale = config.object.scale if isinstance(config.object.scale, float) else 1.0
        called = file_name(f"{hand.name}_{model.name}_{i}")
        path = target if len(sets) == 1 else target / f"{called}{written.suffixes[0]}"
        completed = [judge.completed(record) for record in records]
        write_grasps(path, completed, FormatContext(hand, model, scale), name)
        rows.append(
            {
                "file": str(path),
                "format": name,
                "hand": hand.name,
                "object": model.name,
                "grasps": len(records),
            }
        )
    return rows


def grasp_sets(
    folders: list[Path], which: str = "local"
) -> list[tuple[TrialConfig, list[tuple[TrialResult, GraspRecord]]]]:
    """Return the planned grasps of trials, those of one hand and object together, with their trials.

    Args:
        folders: Results folders.
        which: Which grasps of a trial.

    Raises:
        InputError: There are no such grasps in a trial.
    """
    if which not in WHICH:
        raise InputError(
            f"there are no grasps '{which}' in a trial", remedy=f"choose from {', '.join(WHICH)}"
        )
    sets: dict[tuple[str, str], tuple[TrialConfig, list[tuple[TrialResult, GraspRecord]]]] = {}
    resting: dict[tuple[str, str, int], FloatArray] = {}
    for result in load_results(folders).results:
        grasps = list(_grasps(result, which))
        if result.status != "done" or not grasps or not _is_simulated(result):
            continue
        config = config_from_tree(renewed(result.config))
        key = repr(config.hand), repr(config.object)
        place = key[1], repr(config.scene), config.seed
        if result.moving is not None:
            to_world = np.array(result.moving.transform_object_to_world)
        else:
            if place not in resting:
                resting[place] = _resting(config)
            to_world = resting[place]
        found = ((result, record) for record in _records(result, grasps, config, to_world))
        sets.setdefault(key, (config, []))[1].extend(found)
    return list(sets.values())


def file_name(text: str) -> str:
    """Return a text as a file may be called: names in a results folder may be somebody's paths."""
    return _NO_FILE_NAME.sub("_", text)[-_MAX_NAME:]


def _grasps(result: TrialResult, which: str) -> Iterator[tuple[str, GraspResult]]:
    found: list[tuple[str, GraspResult | None]] = [("local", result.local), ("restarted", result.restarted)]
    found += [(f"global.{measure}", grasp) for measure, grasp in result.global_.items()]
    found += [(f"refined.{measure}", grasp) for measure, grasp in result.refined.items()]
    for name, grasp in found:
        if grasp is not None and grasp.posture is not None and which in ("all", name.split(".")[0]):
            yield name, grasp


def _records(
    result: TrialResult, grasps: list[tuple[str, GraspResult]], config: TrialConfig, to_world: FloatArray
) -> Iterator[GraspRecord]:
    hand = load_hand(config.hand)
    for name, grasp in grasps:
        assert grasp.posture is not None, "only grasps with a hand are taken"
        executed = result.success if name == "local" else None
        yield record_of_posture(
            hand,
            result.object.name,
            np.array(grasp.posture.transform_palm_to_world),
            np.array(grasp.posture.joints),
            to_world,
            points=np.array([contact.point for contact in grasp.contacts]).reshape(-1, 3),
            normals=np.array([contact.normal for contact in grasp.contacts]).reshape(-1, 3),
            source=f"graspbench {name} {result.trial_id}",
            confidence=None if executed is None else float(executed),
        )


def _is_simulated(result: TrialResult) -> bool:
    return result.object.mass_kg is not None


def _resting(config: TrialConfig) -> FloatArray:
    """Return the object's pose at rest, shape (4, 4): it falls as it did in the trial."""
    with World(load_object(config.object), config.scene, config.seed) as world:
        return world.transform_object_to_world
