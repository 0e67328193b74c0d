"""A sweep whose trials go wrong and which is itself killed: nothing is lost, run twice or unreadable."""

import json
import os
import signal
import time

import numpy as np
import pandas as pd
import pytest

from graspbench.config.engine import load_engine
from graspbench.record import recover_log
from graspbench.results.store import ResultStore
from tests.sweep import planting

FAULTS = {
    "exception": ("failed", "unexpected ValueError: planted"),
    "segfault": ("crashed", "SIGSEGV"),
    "hang": ("timeout", "longer than 15 s"),
    "memory": ("failed", "memory"),
}
# A missing mesh is found after the planted faults: with "none" it is a fault of its own.
GRID = (
    "object.mesh=null,missing.stl", "index.fault=none,exception,segfault,hang,memory",
    "--jobs", "2", "--timeout", "15", "--memory", "600",
)  # fmt: skip


@pytest.fixture(scope="module")
def plugin(tmp_path_factory):
    return planting.install(tmp_path_factory.mktemp("plugin"))


def finished(output):
    """Return what is stored: trial id -> version of its result; every file must be readable."""
    versions = {}
    for path in output.glob("[!.]*/result.json"):
        json.loads(path.read_text())
        versions[path.parent.name] = path.stat().st_mtime_ns
    return versions


def interrupt_when(process, output, wanted, how):
    """Send a signal to a sweep once it has stored ``wanted`` results; return how it ended."""
    while process.poll() is None and len(finished(output)) < wanted:
        time.sleep(0.02)
    time.sleep(np.random.default_rng(wanted).uniform(0, 0.4))
    if process.poll() is None:
        os.kill(process.pid, how)
    _, errors = process.communicate(timeout=120)
    return process.returncode, errors


def test_faults_and_kills_touch_no_other_trial(plugin, tmp_path):
    output = tmp_path / "sweep"
    code, _ = interrupt_when(planting.sweep(plugin, output, *GRID), output, 2, signal.SIGKILL)
    assert code == -signal.SIGKILL
    before = finished(output)

    code, errors = interrupt_when(planting.sweep(plugin, output, *GRID), output, 4, signal.SIGINT)
    assert (code, "finishing the trials that are running" in errors) == (130, True), errors
    interrupted = finished(output)
    assert set(interrupted) >= set(before)

    last = planting.sweep(plugin, output, *GRID)
    out, errors = last.communicate(timeout=200)
    assert last.returncode == 1, errors
    assert "2 crashed, 1 done, 5 failed, 2 timeout" in out
    after = finished(output)
    for earlier in (before, interrupted):
        assert {trial_id: after[trial_id] for trial_id in earlier} == earlier  # none was run again

    table = pd.read_csv(output / "trials.csv")
    assert len(table) == len(set(table["trial_id"])) == 10
    for fault, (status, reason) in FAULTS.items():
        rows = table[table["index.fault"] == fault]
        assert set(rows["status"]) == {status}
        assert all(reason in text for text in rows["reason"])
    sound = table[table["index.fault"] == "none"].set_index("status")
    assert "missing.stl" in sound.loc["failed", "reason"]
    assert sound.loc["done", "local.q1"] > 0
    left = {path.name for path in output.iterdir()} - set(after)
    assert left == {".claims", "trials.csv", "trials.parquet"}
    crashed = table[table["index.fault"] == "segfault"]["trial_id"].iloc[0]
    assert "planted.py" in (output / crashed / "error.txt").read_text()
    typed = pd.read_parquet(output / "trials.parquet")
    assert typed["success"].dtype == "boolean"
    assert typed["seed"].dtype == "Int64"
    assert typed["local.q1"].dtype == "Float64"


def test_a_killed_trial_leaves_a_log_that_can_be_recovered(plugin, tmp_path):
    output = tmp_path / "run"
    process = planting.run(plugin, output, "record=full", "record.pictures=false", "search.enabled=true")
    for line in process.stderr:
        if "global_q1 (" in line:  # the next measure is being searched
            break
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    (partial,) = output.glob(".*.partial/trial.mcap.partial")

    saved = recover_log(partial, tmp_path / "saved.mcap")

    assert saved.complete
    assert saved.messages["/camera/image"] == 5  # every view, and the surface, was logged before
    assert saved.messages["/surface/points"] == 1
    assert saved.messages["/log"] > 5
    assert "config.yaml" in saved.attachments


def test_a_claim_is_exclusive_and_ends_with_its_process(tmp_path):
    store = ResultStore(tmp_path)
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        with store.claim("00000000ab") as ours:
            os.write(writer, b"y" if ours else b"n")
            time.sleep(60)
        os._exit(0)
    try:
        assert os.read(reader, 1) == b"y"
        with store.claim("00000000ab") as taken, store.claim("00000000ac") as other:
            assert (taken, other) == (False, True)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    with store.claim("00000000ab") as free:
        assert free


@pytest.mark.parametrize(
    ("overrides", "jobs", "expected"),
    [
        ((), None, ("local", 1)),
        ((), 0, ("inline", 1)),
        ((), 3, ("local", 3)),
        (("engine=slurm", "engine.partition=short"), None, ("slurm", 20)),
        (("engine=slurm",), 4, ("slurm", 4)),
    ],
)
def test_engine_is_composed_from_its_group(overrides, jobs, expected):
    engine = load_engine(overrides, jobs=jobs)
    assert (engine.name, engine.jobs) == expected
