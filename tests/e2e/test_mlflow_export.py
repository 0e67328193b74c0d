"""Trials as runs of MLflow, read back by MLflow itself."""

import json
import sqlite3
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from graspbench.report import mlflow_export
from graspbench.report.mlflow_export import ARTIFACTS, DATABASE
from graspbench.results.trial_result import ObjectResult
from tests.report.made import write_trials

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    tracking = pytest.importorskip("mlflow.tracking", reason="MLflow is an extra")


@pytest.fixture
def results(tmp_path):
    changes = [{"object": ObjectResult("duck")}, {"object": ObjectResult("a/b:c=d\n[x]"), "status": "failed"}]
    return write_trials(tmp_path / "r", changes)


def runs(folder, name="r"):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        client = tracking.MlflowClient(tracking_uri=f"sqlite:///{folder / DATABASE}")
        experiment = client.get_experiment_by_name(name)
        found = client.search_runs([experiment.experiment_id])
        return {run.data.tags["graspbench.trial_id"]: run for run in found}, client


def test_a_trial_is_a_run_with_what_was_asked_and_what_came_of_it(cli, results, tmp_path):
    finished = cli("report", results, "--format", "csv", "--mlflow", tmp_path / "ml", "--json")
    assert finished.code == 0, finished.stderr
    assert str(tmp_path / "ml" / DATABASE) in finished.document["files"]
    assert "mlflow.store" not in finished.stderr
    found, client = runs(tmp_path / "ml")
    stored = {path.parent.name: json.loads(path.read_text()) for path in results.glob("*/result.json")}
    assert set(found) == set(stored)
    for trial_id, run in found.items():
        result = stored[trial_id]
        assert run.info.run_name == trial_id
        assert run.info.status == ("FINISHED" if result["status"] == "done" else "FAILED")
        assert run.data.tags["graspbench.status"] == result["status"]
        assert run.data.params["object.name"] == result["object"]["name"]
        assert run.data.params["seed"] == str(result["seed"])
        if result["status"] == "done":
            assert run.data.metrics["local.q1"] == result["local"]["q1"]
            assert run.data.metrics["success"] == float(result["success"])
        assert not set(run.data.metrics) & set(run.data.params)
        names = {each.path for each in client.list_artifacts(run.info.run_id)}
        assert {"result.json", "config.yaml"} <= names
        assert Path(run.info.artifact_uri.removeprefix("file://")).is_relative_to(tmp_path / "ml" / ARTIFACTS)


def test_a_second_export_writes_what_has_changed_only(cli, results, tmp_path):
    command = ("report", results, "--format", "csv", "--mlflow", tmp_path / "ml")
    assert cli(*command).code == 0
    before, _ = runs(tmp_path / "ml")
    path = sorted(results.glob("*/result.json"))[0]
    result = json.loads(path.read_text())
    path.write_text(json.dumps(result | {"reason": "again"}))
    assert cli(*command).code == 0
    after, _ = runs(tmp_path / "ml")
    changed = path.parent.name
    assert set(after) == set(before)
    assert after[changed].data.tags["graspbench.reason"] == "again"
    for trial_id, run in after.items():
        assert (run.info.run_id == before[trial_id].info.run_id) == (trial_id != changed)


def test_links_out_of_a_received_folder_are_not_followed(cli, results, tmp_path):
    secret = tmp_path / "secret.png"
    secret.write_text("secret")
    for folder in results.glob("*/"):
        (folder / "picture.png").symlink_to(secret)
        (folder / "error.txt").symlink_to(secret)
    assert cli("report", results, "--format", "csv", "--mlflow", tmp_path / "ml").code == 0
    assert not [path for path in (tmp_path / "ml").rglob("*") if path.name in ("picture.png", "error.txt")]


@pytest.mark.parametrize("fault", ["a file", "no database", "another database", "an odd name"])
def test_a_place_that_cannot_be_used_is_one_sentence(cli, results, tmp_path, fault):
    place = tmp_path / "ml"
    if fault == "an odd name":
        place = tmp_path / "ml?x=1%41"
    elif fault == "a file":
        place.write_text("mine")
    else:
        place.mkdir()
        if fault == "no database":
            (place / DATABASE).write_bytes(b"mine" * 5000)
        else:
            with sqlite3.connect(place / DATABASE) as database:
                database.execute("create table experiments (mine)")
            database.close()
    finished = cli("report", results, "--format", "csv", "--mlflow", place)
    assert finished.code == 2
    assert "Traceback" not in finished.stderr
    assert str(place) in finished.stderr.splitlines()[-1]


def test_without_mlflow_its_name_is_told(cli, results, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mlflow.tracking", None)
    finished = cli("report", results, "--format", "csv", "--mlflow", tmp_path / "ml")
    assert finished.code == 2
    assert "pip install mlflow-skinny" in finished.stderr


def test_names_are_what_mlflow_takes():
    assert mlflow_export._name("times_s.images") == "times_s.images"
    assert mlflow_export._name("index.fault[0]:é") == "index.fault_0___"
    assert mlflow_export._name("../../x") == "x"


def test_numbers_are_what_a_metric_can_be():
    numbers = [True, 3, 2.5, np.float64(1.5), np.bool_(False)]
    assert [mlflow_export._number(each) for each in numbers] == [1.0, 3.0, 2.5, 1.5, 0.0]
    for none in (float("nan"), float("inf"), 10**400, None, "3", pd.NA):
        assert mlflow_export._number(none) is None
