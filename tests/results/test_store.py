import itertools
import json
import os
import signal
import subprocess
import sys
import textwrap

import numpy as np
import pandas as pd
import pytest

from graspbench.errors import LogError
from graspbench.results.columns import results_frame
from graspbench.results.migrations import SCHEMA_VERSION
from graspbench.results.plain import to_json
from graspbench.results.store import ResultStore, load_results, read_result, write_atomically
from graspbench.results.trial_result import (
    ObjectResult,
    ProvenanceResult,
    ReconstructionResult,
    TrialResult,
)


def _result(trial_id, **more):
    return TrialResult(trial_id=trial_id, status="done", schema=SCHEMA_VERSION, **more)


def _write(store, trial_id, **more):
    with store.writing(trial_id) as folder:
        (folder / "config.yaml").write_text("seed: 0\n")
        (folder / "result.json").write_text(to_json(_result(trial_id, **more)))


def test_a_trial_appears_whole(tmp_path):
    store = ResultStore(tmp_path / "r")
    with store.writing("abc") as folder:
        (folder / "result.json").write_text(to_json(_result("abc")))
        assert store.result("abc") is None
    assert store.result("abc") == _result("abc")
    assert [path.name for path in store.root.iterdir()] == ["abc"]


def test_a_trial_that_raises_leaves_nothing_and_keeps_the_old_one(tmp_path):
    store = ResultStore(tmp_path / "r")

    def fail():
        with store.writing("abc") as folder:
            (folder / "half").write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert not store.root.exists()
    _write(store, "abc", seed=1)
    with pytest.raises(RuntimeError):
        fail()
    assert store.result("abc").seed == 1
    assert [path.name for path in store.root.iterdir()] == ["abc"]


def test_a_trial_written_again_replaces_the_old_one(tmp_path):
    store = ResultStore(tmp_path)
    _write(store, "abc", seed=1)
    _write(store, "abc", seed=2)
    assert store.result("abc").seed == 2
    assert [path.name for path in tmp_path.iterdir()] == ["abc"]


@pytest.mark.parametrize("point", ["before rename", "between renames"])
def test_a_killed_writer_loses_no_finished_trial(tmp_path, point):
    store = ResultStore(tmp_path)
    _write(store, "abc", seed=1)
    script = textwrap.dedent(
        f"""
        import os, pathlib, signal
        from graspbench.results.plain import to_json
        from graspbench.results.store import ResultStore
        rename = pathlib.Path.rename
        calls = []
        def killing(self, target):
            calls.append(target)
            if len(calls) == {1 if point == "before rename" else 2}:
                os.kill(os.getpid(), signal.SIGKILL)
            return rename(self, target)
        pathlib.Path.rename = killing
        with ResultStore(pathlib.Path({str(tmp_path)!r})).writing("abc") as folder:
            new = {{"schema": 3, "trial_id": "abc", "status": "done", "seed": 2}}
            (folder / "result.json").write_text(to_json(new))
        """
    )
    done = subprocess.run([sys.executable, "-c", script], check=False)
    assert done.returncode == -signal.SIGKILL
    assert ResultStore(tmp_path).result("abc").seed in {1, 2}
    assert len(ResultStore(tmp_path).results()) == 1


def test_atomic_write_leaves_no_temporary_file(tmp_path):
    write_atomically(tmp_path / "deep" / "file.txt", "one")
    write_atomically(tmp_path / "deep" / "file.txt", "two")
    assert (tmp_path / "deep" / "file.txt").read_text() == "two"
    assert len(os.listdir(tmp_path / "deep")) == 1


def test_json_is_strict():
    text = to_json({"a": np.float64("nan"), "b": np.arange(3), "c": (1.5, float("inf")), "d": np.bool_(True)})
    assert json.loads(text) == {"a": None, "b": [0, 1, 2], "c": [1.5, None], "d": True}


def test_frame_has_dotted_columns_and_no_arrays():
    measured = ReconstructionResult(nodes=5, snapshots=2, iterations=3, mesh_mean_mm=0.5)
    body = ObjectResult("a", 1.0, (0.1, 0.2, 0.3))
    frame = results_frame([_result("a", object=body, reconstruction=measured), _result("b")])
    assert list(frame.columns[:4]) == ["trial_id", "status", "reason", "success"]
    assert frame["reconstruction.mesh_mean_mm"][0] == 0.5
    assert pd.isna(frame["reconstruction.mesh_mean_mm"][1])
    assert not [name for name in frame.columns if "extents" in name]


def test_frame_has_a_column_for_every_choice_and_override_of_any_trial():
    first = _result(
        "a", choice={"surface": "smooth"}, overridden=("camera.width",), config={"camera": {"width": 3}}
    )
    second = _result("b", choice={"surface": "thesis"}, config={"camera": {"width": 6}})
    frame = results_frame([first, second])
    assert list(frame.columns[4:6]) == ["choice.surface", "camera.width"]
    assert frame["camera.width"].tolist() == [3, 6]


def test_merged_folders_hold_each_trial_once(tmp_path):
    first, second = ResultStore(tmp_path / "one"), ResultStore(tmp_path / "two")
    _write(first, "abc", seed=1)
    _write(second, "abc", seed=2)
    _write(second, "xyz", seed=3)
    merged = {result.trial_id: result.seed for result in load_results([first.root, second.root]).results}
    assert merged == {"abc": 1, "xyz": 3}


@pytest.mark.parametrize("content", ["", "{", "[]", '{"schema": 99}', "\x00\x01"])
def test_an_unreadable_result_is_named(tmp_path, content):
    path = tmp_path / "result.json"
    path.write_text(content)
    with pytest.raises(LogError, match=r"result\.json"):
        read_result(path)


def test_a_result_of_the_first_schema_is_brought_to_the_present_one(tmp_path):
    old = {"schema": 1, "trial_id": "a", "status": "done", "provenance": {"cpu": "x", "finished": "then"}}
    path = tmp_path / "result.json"
    path.write_text(to_json(old))
    result = read_result(path)
    assert result.schema == SCHEMA_VERSION
    assert result.kind == "trial"
    assert result.provenance == ProvenanceResult(cpu="x", finished="then")
    assert json.loads(path.read_text()) == old
    path.write_text(to_json({**old, "motion": {"name": "rotate"}}))
    assert read_result(path).kind == "manipulation"


def test_an_old_result_that_executed_nothing_is_no_success(tmp_path):
    path = tmp_path / "result.json"
    old = {"schema": 2, "trial_id": "a", "status": "done", "success": True, "execution": None}
    path.write_text(to_json(old))
    assert read_result(path).success is None


@pytest.mark.parametrize(
    "content",
    ["", "{", '{"schema": 3}', '{"schema": 99}', "[" * 100_000, '{"schema": 2, "provenance": null}'],
)
def test_one_unreadable_trial_is_one_row_and_stops_nobody(tmp_path, content):
    store = ResultStore(tmp_path)
    _write(store, "abc")
    _write(store, "bad")
    (tmp_path / "bad" / "result.json").write_text(content)
    assert {result.trial_id: result.status for result in store.results()} == {
        "abc": "done",
        "bad": "unreadable",
    }
    assert sorted(load_results([tmp_path]).folders) == ["abc", "bad"]
    store.write_table()
    assert pd.read_csv(tmp_path / "trials.csv")["status"].tolist() == ["done", "unreadable"]


@pytest.mark.parametrize("place", ["value", "key"])
def test_half_a_character_makes_a_trial_unreadable_and_stops_nobody(tmp_path, place):
    store = ResultStore(tmp_path)
    _write(store, "abc")
    _write(store, "bad")
    path = tmp_path / "bad" / "result.json"
    found = json.loads(path.read_text())
    found |= {"reason": "\ud800"} if place == "value" else {"times_s": {"\ud800": 1.0}}
    path.write_text(json.dumps(found))
    assert {result.trial_id: result.status for result in store.results()} == {
        "abc": "done",
        "bad": "unreadable",
    }
    store.write_table()
    assert pd.read_csv(tmp_path / "trials.csv")["status"].tolist() == ["done", "unreadable"]
    found |= {"reason": "\u00e9 \U0001f600", "times_s": {}}
    path.write_text(json.dumps(found))
    assert store.result("bad").reason == found["reason"]


def test_what_is_no_file_of_a_result_s_size_is_not_read(tmp_path):
    store = ResultStore(tmp_path)
    for name in ("fifo", "huge"):
        _write(store, name)
        (tmp_path / name / "result.json").unlink()
    os.mkfifo(tmp_path / "fifo" / "result.json")
    with (tmp_path / "huge" / "result.json").open("wb") as stream:
        stream.truncate(1 << 40)
    results = load_results([tmp_path]).results
    assert {result.trial_id: result.status for result in results} == {
        "fifo": "unreadable",
        "huge": "unreadable",
    }


def test_an_old_result_beside_a_bomb_is_read(tmp_path):
    bomb = "a: &a [x, x, x, x, x, x, x, x, x, x]\n"
    for inner, outer in itertools.pairwise("abcdefghi"):
        bomb += f"{outer}: &{outer} [{', '.join([f'*{inner}'] * 10)}]\n"
    (tmp_path / "config.yaml").write_text(bomb)
    path = tmp_path / "result.json"
    path.write_text(to_json({"schema": 2, "trial_id": "a", "status": "done"}))
    assert read_result(path).config == {}


def test_a_typed_result_survives_its_json(tmp_path):
    result = _result("a", times_s={"images": 0.5}, object=ObjectResult("duck", 0.1, (0.1, 0.2, float("nan"))))
    path = tmp_path / "result.json"
    path.write_text(to_json(result))
    found = read_result(path)
    assert to_json(found) == to_json(result)
    assert found["object"]["name"] == found.object.name == "duck"
