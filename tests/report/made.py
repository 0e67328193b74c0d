"""Results folders made by hand, of typed results."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from graspbench.results.grasp_results import GlobalGraspResult, LocalResult
from graspbench.results.migrations import SCHEMA_VERSION
from graspbench.results.physical_results import ExecutedResult
from graspbench.results.plain import to_json
from graspbench.results.trial_result import HandResult, ObjectResult, ProvenanceResult, TrialResult

LOCAL = LocalResult(
    q1=0.5, q2=2.0, q3=0.1, score=1.0, rotations_tried=1, rejected={}, iterations=1, surfaces_made=1, moves=1,
    evaluations=1, contour_queries=1, cycles=0, force_closure=True, reconstruction_time_s=0.1,
    planning_time_s=0.2, time_s=0.3,
)  # fmt: skip
GLOBAL = GlobalGraspResult(
    value=0.8,
    upper_bound=0.8,
    upper_bound_up_to_solver=0.8,
    gap=0.0,
    optimal=True,
    optimal_up_to_solver=True,
    doubtful=0,
    evaluated=1,
    pruned=0.9,
    placements=1,
    time_s=1.0,
)
EXECUTED = ExecutedResult(
    success=True, reason=None, fingers=3, contacts_made=3, contact_time_s=(), contact_error_m=(),
    tip_error_max_m=0.0, palm_error_max_m=0.0, object_displacement_m=0.0, object_turn_deg=0.0,
    grip_force_n=1.0, time_s=1.0, largest_push_weight=2.0,
)  # fmt: skip


def made_result(trial_id: str, seed: int = 0, **changes: Any) -> TrialResult:
    """Return a trial of the duck that is done; ``changes`` are fields of the result."""
    q1 = 0.5 + 0.01 * seed
    plain = TrialResult(
        trial_id=trial_id, status="done", success=True, seed=seed, schema=SCHEMA_VERSION,
        object=ObjectResult("duck"), hand=HandResult("radial", 3), index={"name": "force_field", "k_cm": 1.0},
        local=replace(LOCAL, q1=q1), global_={"q1": GLOBAL}, ratio={"q1": q1 / 0.8}, execution=EXECUTED,
        config={"quality": {"friction": 0.5, "contact": "hard_finger"}, "execution": {"friction": 0.5}},
        provenance=ProvenanceResult(graspbench="0.1.0", git={"commit": "a" * 40, "dirty": False}),
    )  # fmt: skip
    named = {field.name for field in fields(TrialResult)}
    assert set(changes) <= named, set(changes) - named
    return replace(plain, **changes)


def write_trials(folder: Path, trials: Sequence[Mapping[str, Any]]) -> Path:
    """Write a results folder of trials, each given by the fields in which it differs from a plain one.

    A field ``settings`` holds values of the configuration by their dotted names, as if overridden.
    """
    for k, given in enumerate(trials):
        changes = {"seed": k, **given}
        settings = changes.pop("settings", {})
        result = made_result(f"{ord(folder.name[0]):04x}{k:06x}", **changes)
        config: dict[str, Any] = {section: dict(values) for section, values in result.config.items()}
        for name, value in settings.items():
            section, _, key = name.partition(".")
            config.setdefault(section, {})[key] = value
        result = replace(result, config=config, overridden=tuple(settings))
        place = folder / result.trial_id
        place.mkdir(parents=True)
        (place / "config.yaml").write_text("seed: 0\n")
        (place / "result.json").write_text(to_json(result), encoding="utf-8")
    return folder
