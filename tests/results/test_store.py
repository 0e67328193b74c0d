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
from graspbench.results.store import (
    ResultStore,
    load_results,
    read_result,
    results_frame,
    to_json,
    write_atomically,
)


def _result(trial_id, **more):
    return {"schema": 2, "trial_id": trial_id, "status": "done", **more}


def _write(store, trial_id, **more):
    with store.writing(trial_id) as folder:
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
    _write(store, "abc", value=1)
    with pytest.raises(RuntimeError):
        fail()
    assert store.result("abc")["value"] == 1
    assert [path.name for path in store.root.iterdir()] == ["abc"]


def test_a_trial_written_again_replaces_the_old_one(tmp_path):
    store = ResultStore(tmp_path)
    _write(store, "abc", value=1)
    _write(store, "abc", value=2)
    assert store.result("abc")["value"] == 2
    assert [path.name for path in tmp_path.iterdir()] == ["abc"]


@pytest.mark.parametrize("point", ["before rename", "between renames"])
def test_a_killed_writer_loses_no_finished_trial(tmp_path, point):
    store = ResultStore(tmp_path)
    _write(store, "abc", value=1)
    script = textwrap.dedent(
        f"""
        import os, pathlib, signal
        from graspbench.results.store import ResultStore, to_json
        rename = pathlib.Path.rename
        calls = []
        def killing(self, target):
            calls.append(target)
            if len(calls) == {1 if point == "before rename" else 2}:
                os.kill(os.getpid(), signal.SIGKILL)
            return rename(self, target)
        pathlib.Path.rename = killing
        with ResultStore(pathlib.Path({str(tmp_path)!r})).writing("abc") as folder:
            (folder / "result.json").write_text(to_json({{"schema": 2, "trial_id": "abc", "value": 2}}))
        """
    )
    done = subprocess.run([sys.executable, "-c", script], check=False)
    assert done.returncode == -signal.SIGKILL
    assert ResultStore(tmp_path).result("abc")["value"] in {1, 2}
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
    frame = results_frame([_result("a", local={"q1": 0.5, "contacts": [1, 2]}), _result("b")])
    assert list(frame.columns) == ["schema", "trial_id", "status", "local.q1"]
    assert pd.isna(frame["local.q1"][1])


def test_merged_folders_hold_each_trial_once(tmp_path):
    first, second = ResultStore(tmp_path / "one"), ResultStore(tmp_path / "two")
    _write(first, "abc", value=1)
    _write(second, "abc", value=2)
    _write(second, "xyz", value=3)
    merged = {result["trial_id"]: result["value"] for result in load_results([first.root, second.root])}
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
    assert result["schema"] == 2
    assert result["kind"] == "trial"
    assert result["provenance"] == {
        "host": None, "started": None, "seconds": None, "cpu": "x", "finished": "then",
    }  # fmt: skip
    assert json.loads(path.read_text()) == old
    path.write_text(to_json({**old, "motion": {"name": "rotate"}}))
    assert read_result(path)["kind"] == "manipulation"
