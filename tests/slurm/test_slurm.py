"""Sweeps as jobs: on a real SLURM of one node where it can be started, and as plain processes everywhere."""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pandas as pd
import pytest

from tests.sweep import planting

LOOPBACK = Path(__file__).parent / "loopback"
TOOLS = all(
    shutil.which(name, path="/usr/sbin:/usr/bin") for name in ("slurmctld", "slurmd", "munged", "squeue")
)


@pytest.fixture(scope="module")
def plugin(tmp_path_factory):
    return planting.install(tmp_path_factory.mktemp("plugin"))


@pytest.fixture
def slurm(monkeypatch):
    """Start SLURM's daemons on the loopback."""
    if not TOOLS:
        pytest.skip("no SLURM here (tests/system-tools installs it)")
    if os.geteuid() != 0:
        pytest.skip("SLURM's daemons need root")
    folder = Path(tempfile.mkdtemp(prefix="slurm"))
    folder.chmod(0o755)  # munge runs as a user of its own
    started = subprocess.run(
        [LOOPBACK, "start", folder], capture_output=True, text=True, check=False, timeout=60
    )
    if started.returncode != 0:
        shutil.rmtree(folder)
        pytest.skip(f"SLURM does not start here: {started.stderr.strip()[-200:]}")
    monkeypatch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
    yield
    subprocess.run([LOOPBACK, "stop", folder], check=False, timeout=60)
    time.sleep(1.0)
    shutil.rmtree(folder, ignore_errors=True)


def stored(output):
    return {path.parent.name: path.stat().st_mtime_ns for path in output.glob("[!.]*/result.json")}


def wait_for(condition, process, seconds=200):
    end = time.monotonic() + seconds
    while not condition() and process.poll() is None:
        assert time.monotonic() < end, "nothing happens"
        time.sleep(0.2)


def queue(state):
    command = ["squeue", "--noheader", "--array", "--states", state, "--format", "%i"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.timeout(600)
def test_jobs_that_are_requeued_or_cancelled_leave_every_row_once(slurm, plugin, tmp_path):
    output = tmp_path / "sweep"
    grid = (
        "seed=range(0,20)",
        "engine=slurm",
        "engine.jobs=2",
        "engine.trials_per_job=5",
        "engine.poll_s=0.5",
    )
    sweep = planting.sweep(plugin, output, *grid)
    try:
        wait_for(lambda: len(stored(output)) >= 2 and len(queue("RUNNING")) == 2, sweep)
        first, second = queue("RUNNING")
        before = stored(output)
        subprocess.run(["scontrol", "requeue", first], check=True)
        subprocess.run(["scancel", second], check=True)
        out, errors = sweep.communicate(timeout=400)
    finally:
        if sweep.poll() is None:
            os.kill(sweep.pid, signal.SIGKILL)
    assert sweep.returncode == 0, errors
    assert "20 done" in out
    table = pd.read_csv(output / "trials.csv")
    assert sorted(table["seed"]) == list(range(20))
    after = stored(output)
    assert {trial_id: after[trial_id] for trial_id in before} == before  # what was finished is not run again
    assert queue("RUNNING,PENDING") == []


def test_plain_processes_stand_in_for_slurm(plugin, tmp_path):
    output = tmp_path / "sweep"
    sweep = planting.sweep(
        plugin, output, "seed=0,1", "index.fault=none,segfault", "engine=slurm", "engine.cluster=local",
        "engine.jobs=1", "engine.trials_per_job=4", "engine.poll_s=0.2",
    )  # fmt: skip
    out, errors = sweep.communicate(timeout=250)
    assert sweep.returncode == 1, errors
    assert "2 crashed, 2 done" in out
    assert len(pd.read_csv(output / "trials.csv")) == 4
