"""A trial whose pictures another process draws is the same trial."""

import dataclasses

import pytest

from graspbench.config.trial_config import load_config
from graspbench.errors import SimulationError
from graspbench.results.store import ResultStore
from graspbench.trial.drawer import drawer
from graspbench.trial.runner import run_and_store

# Small pictures and a coarse surface: what is asked here does not depend on them.
CHEAP = (
    "object=cylinder", "search.enabled=false", "execution=contact", "camera.width=160", "camera.height=120",
    "camera.fx=150", "camera.fy=150", "surface.meridians=12", "surface.parallels=10",
)  # fmt: skip


def _run(folder, *, beside):
    heard = []
    store = ResultStore(folder)
    with drawer(beside=beside) as draws:
        result = run_and_store(
            load_config(list(CHEAP)),
            store,
            on_stage=lambda stage, seconds: heard.append(stage),
            contain=True,
            beside=draws,
        )
    files = {path.name: path.read_bytes() for path in store.folder(result.trial_id).iterdir()}
    return result, files, heard


@pytest.fixture
def two_cores(monkeypatch):
    monkeypatch.setattr("graspbench.trial.drawer.threads_available", lambda: 2)


@pytest.mark.usefixtures("two_cores")
def test_pictures_log_and_result_are_the_same(tmp_path):
    here, files_here, heard_here = _run(tmp_path / "here", beside=False)
    there, files_there, heard_there = _run(tmp_path / "there", beside=True)
    assert heard_here == heard_there
    assert there.times_s.keys() == here.times_s.keys()
    assert there.times_s["pictures"] > 0.0
    assert files_there.keys() == files_here.keys()
    assert {"views.png", "surface.png", "grasp.png", "hand.png", "geometry.jsonl"} <= files_there.keys()
    for name in files_here.keys() - {"result.json"}:  # which has times in it
        assert files_there[name] == files_here[name], name
    assert dataclasses.asdict(there)["execution"] == dataclasses.asdict(here)["execution"]


@pytest.mark.usefixtures("two_cores")
@pytest.mark.parametrize("beside", [False, True])
def test_a_trial_that_fails_keeps_only_what_was_seen(tmp_path, monkeypatch, beside):
    def fails(*_):
        raise SimulationError("the object's pose is not finite", remedy="reduce execution.time_step_s")

    monkeypatch.setattr("graspbench.trial.pipeline.execute_grasp", fails)
    result, files, _ = _run(tmp_path, beside=beside)
    assert result.status == "failed"
    shown = {name for name in files if not name.endswith((".json", ".yaml", ".partial", ".txt"))}
    assert shown == {"views.png", "surface.png"}


def test_nothing_is_drawn_beside_on_a_single_core(tmp_path, monkeypatch):
    monkeypatch.setattr("graspbench.trial.drawer.threads_available", lambda: 1)
    monkeypatch.setattr("graspbench.beside.subprocess.Popen", None)  # whoever calls it fails
    result, files, _ = _run(tmp_path, beside=True)
    assert result.status == "done"
    assert "grasp.png" in files
