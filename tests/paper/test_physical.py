"""Planned grasps in physics: counts, and the whole experiment through the command line."""

import csv
import json

import pytest

from graspbench.paper.physical import success_rows
from graspbench.results.physical_results import ExecutedResult
from graspbench.results.trial_result import ObjectResult, TrialResult
from tests.e2e.conftest import cli  # noqa: F401  the real command line, in this process
from tests.small import SMALL_PICTURES

CHEAP = ("execution=contact", "surface.meridians=12", "surface.parallels=10", *SMALL_PICTURES)


def trial(name, success=None, push=None, reason=None):
    execution = None
    if success is not None:
        execution = ExecutedResult(
            success=success, reason=reason, fingers=3, contacts_made=3, contact_time_s=(), contact_error_m=(),
            tip_error_max_m=0.0, palm_error_max_m=0.0, object_displacement_m=0.0, object_turn_deg=0.0,
            grip_force_n=1.0, time_s=1.0, largest_push_weight=push,
        )  # fmt: skip
    return TrialResult(
        trial_id=name,
        status="done" if execution else "failed",
        reason=None if execution else reason,
        object=ObjectResult(name),
        execution=execution,
    )


def test_only_planned_grasps_count():
    rows = success_rows(
        [
            trial("cup", True, 2.0),
            trial("cup", False, None, "dropped"),
            trial("cup", None, None, "no grasp is within reach"),
            trial("ball", True, 4.0),
            trial("ball", True, 6.0),
        ]
    )
    ball, cup, everything = rows
    assert (ball["object"], cup["object"], everything["object"]) == ("ball", "cup", "all")
    assert (cup["trials"], cup["planned"], cup["held"], cup["rate"]) == (3, 2, 1, 0.5)
    assert cup["reasons"] == "dropped; no grasp is within reach"
    assert (everything["planned"], everything["held"]) == (4, 3)
    assert ball["push_weight"] == 5.0
    # Wilson's interval for 2 of 2 is [n / (n + z^2), 1].
    assert (ball["low"], ball["high"]) == (pytest.approx(2 / (2 + 1.959964**2)), 1.0)


def test_experiment_writes_its_tables_and_resumes(cli, tmp_path):  # noqa: F811
    output = tmp_path / "physical"
    arguments = ("paper", "physical", "object=cylinder,box", "seed=0", *CHEAP, "--jobs", 0, "--json")
    finished = cli(*arguments, "-o", output)
    assert finished.code == 0, finished.stderr
    names = [row["object"] for row in finished.document["rows"]]
    assert names == ["box", "cylinder", "all"]
    assert all(row["trials"] == 1 for row in finished.document["rows"][:2])
    with (output / "table.csv").open(newline="") as stream:
        assert [row["object"] for row in csv.DictReader(stream)] == names
    written = {path.name for path in output.iterdir()}
    assert {"table.md", "table.tex", "correlations.md", "correlations.csv", "trials.csv"} <= written
    before = {path: path.stat().st_mtime_ns for path in output.glob("*/result.json")}
    again = cli(*arguments, "-o", output)
    assert again.document == finished.document
    assert before == {path: path.stat().st_mtime_ns for path in output.glob("*/result.json")}
    assert json.loads((output / "result.json").read_text())["rows"] == finished.document["rows"]
