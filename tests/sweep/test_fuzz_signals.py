"""Kills and signals at random moments of a sweep: nothing is lost or doubled, nobody is left behind.

With GRASPBENCH_FUZZ=60 in the environment so many are sent, half of them kill -9, instead of a few.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from tests.fuzz import Budget
from tests.sweep.test_signals import QUICK, _group_is_gone, _heed_signals

BUDGET = Budget(2, most=60)
COUNT = BUDGET.count
GENTLE = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
COMMAND = [
    sys.executable, "-m", "graspbench.cli", "sweep", *QUICK[:-1], "seed=range(0,500)", "--jobs", "1", "-o",
]  # fmt: skip


def stored(output):
    """Return what is stored: trial id -> version of its result; every file must be readable."""
    found = {}
    for path in output.glob("[!.]*/result.json"):
        assert json.loads(path.read_text())["status"] in ("done", "crashed")
        found[path.parent.name] = path.stat().st_mtime_ns
    return found


def workers(group):
    """Return the processes that run trials: children of the one that forks them, not of the sweep itself."""
    found = []
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            parent = int(Path(f"/proc/{name}/stat").read_text().rpartition(")")[2].split()[1])
            if os.getpgid(int(name)) == group and group not in (int(name), parent):
                found.append(int(name))
        except (ProcessLookupError, FileNotFoundError):
            continue
    return found


def ends(process, how, rng):
    """Send a signal to a sweep, or kill the sweep or one of its workers; wait until it has ended."""
    if how == "worker":
        for worker in rng.permutation(workers(process.pid))[:1]:
            os.kill(int(worker), signal.SIGKILL)
        time.sleep(float(rng.uniform(0.0, 1.5)))
        how = signal.SIGINT
    if how == signal.SIGINT:
        os.killpg(process.pid, how)
    else:
        process.send_signal(how)
    _, errors = process.communicate(timeout=120)
    return errors


@BUDGET.timeout
def test_signals_at_random_moments(tmp_path):
    rng = np.random.default_rng(9)
    output, before = tmp_path / "r", {}
    for k in range(COUNT):
        how = ("worker", signal.SIGKILL)[k // 2 % 2] if k % 2 else GENTLE[k // 2 % 3]
        with BUDGET.case(f"{k}, {how!r}"):
            interrupt(how, output, before, rng)
        before = stored(output)
    assert COUNT < 10 or before
    BUDGET.check()
    print(f"{COUNT} signals, {len(before)} trials stored")


def interrupt(how, output, before, rng):
    """Start a sweep, send a signal at a random moment, look at what is left."""
    left = set(output.glob(".*.partial"))  # by a kill before
    process = subprocess.Popen(
        [*COMMAND, str(output)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=_heed_signals,
    )  # fmt: skip
    if rng.integers(2):  # while trials are run, however long the start takes
        while process.poll() is None and len(stored(output)) == len(before):
            time.sleep(0.1)
        time.sleep(float(rng.uniform(0.0, 1.5)))
    else:
        time.sleep(float(rng.uniform(0.5, 8.0)))
    errors = ends(process, how, rng)
    assert process.returncode in (130, 2, -signal.SIGKILL, *(-each for each in GENTLE)), errors
    assert "Traceback" not in errors, errors
    deadline = time.monotonic() + 20
    while not _group_is_gone(process.pid) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert _group_is_gone(process.pid)
    after = stored(output)
    assert {trial: after.get(trial) for trial in before} == before  # nothing lost, nothing run twice
    if how in GENTLE and output.is_dir():
        assert set(output.glob(".*.partial")) <= left
