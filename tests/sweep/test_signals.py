"""Signals at any moment: one sentence, nothing half-written, workers gone with their parent."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tests.small import SMALL_PICTURES

QUICK = (
    "object=sphere", "experiment=quick", "surface.meridians=12", "surface.parallels=11", *SMALL_PICTURES,
    "seed=range(0,30)",
)  # fmt: skip


def _started(command: list[str]) -> subprocess.Popen[str]:
    """Start a command as a terminal does: in a group of its own, no signal ignored (as under nohup)."""
    return subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=_heed_signals,
    )


def _heed_signals() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def _group_is_gone(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


@pytest.mark.parametrize("after_s", [0.5, 1.5, 4.0])
@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_sweep_cleanly(tmp_path, which, after_s):
    command = [
        sys.executable,
        "-m",
        "graspbench.cli",
        "sweep",
        *QUICK,
        "--jobs",
        "1",
        "-o",
        str(tmp_path / "r"),
    ]
    process = _started(command)
    time.sleep(after_s)
    if which == signal.SIGINT:
        os.killpg(process.pid, which)  # as a terminal sends it
    else:
        process.send_signal(which)
    _, stderr = process.communicate(timeout=120)
    # By its number when it comes before the command has begun.
    assert process.returncode in (130, -which, -signal.SIGINT), stderr
    assert "Traceback" not in stderr
    assert "BrokenProcessPool" not in stderr
    assert not list(tmp_path.glob("r/.*.partial"))
    deadline = time.monotonic() + 20
    while not _group_is_gone(process.pid) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert _group_is_gone(process.pid)


@pytest.mark.parametrize("which", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_run_cleanly(tmp_path, which):
    command = [sys.executable, "-m", "graspbench.cli", "run", *QUICK[:-1], "-o", str(tmp_path / "p" / "r")]
    process = _started(command)
    assert process.stderr is not None
    first = process.stderr.readline()  # a stage has ended: the trial is under way
    process.send_signal(which)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode in (0, 130), first + stderr  # 0 if it was done by then
    assert "Traceback" not in stderr
    if process.returncode == 130:
        assert list(tmp_path.iterdir()) == []
