"""Where output goes when there is no room, no stream, or a stream that takes ASCII alone."""

import errno
import os
import subprocess
import sys
from unittest import mock

import pandas as pd
import pytest

from graspbench.record import TrialLog
from tests.small import SMALL_PICTURES

QUICK = ("experiment=quick", "object=sphere", "surface.meridians=12", "surface.parallels=11", *SMALL_PICTURES)


def shell(command, **environment):
    line = command.replace("graspbench", f"{sys.executable} -m graspbench.cli", 1)
    return subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, timeout=200, check=False,
        env={**os.environ, **environment},
    )  # fmt: skip


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_a_full_output_is_one_sentence():
    done = shell("graspbench objects list --json >/dev/full")
    assert (done.returncode, done.stderr) == (2, "graspbench: No space left on device.\n")


@pytest.mark.parametrize("closed", [">&-", "<&- >&-", ">&- 2>&-"])
def test_a_closed_output_is_told_before_anything_is_done(closed, tmp_path):
    done = shell(f"graspbench run -o '{tmp_path / 'r'}' {closed}")
    told = "graspbench: the standard output is closed: send it to a file, or to /dev/null.\n"
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == ("" if "2>" in closed else told)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("quiet", ["2>&-", "<&-", "| head -n 1"])
def test_a_pipe_that_is_closed_or_a_closed_progress_ends_quietly(quiet):
    done = shell(f"graspbench objects list --json {quiet}")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("{")


def test_an_output_of_ascii_alone_gets_what_it_can_take(tmp_path):
    folder = tmp_path / "é"
    done = shell(f"graspbench report '{folder}'", PYTHONIOENCODING="ascii", LC_ALL="C")
    assert done.returncode == 2
    assert "\\xe9" in done.stderr
    assert "Traceback" not in done.stderr
    done = shell("graspbench objects list", PYTHONIOENCODING="ascii", LC_ALL="C")
    assert done.returncode == 0
    assert "teddy" in done.stdout


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS])
def test_a_disk_that_takes_no_more_is_no_failure_of_the_trial(cli, tmp_path, number):
    full = OSError(number, os.strerror(number))
    command = ("sweep", *QUICK, "record=scores", "seed=0,1", "--jobs", 0, "-o", tmp_path / "r")
    with mock.patch.object(TrialLog, "scores", side_effect=full):
        finished = cli(*command)
    assert finished.code == 2, finished.stderr
    assert "nothing can be written to" in finished.stderr
    assert os.strerror(number) in finished.stderr
    assert [path for path in (tmp_path / "r").glob("*") if path.is_dir()] == []
    assert cli(*command).code == 0
    assert pd.read_csv(tmp_path / "r" / "trials.csv")["status"].tolist() == ["done", "done"]


@pytest.fixture
def disk(tmp_path):
    """Mount a small disk with options, where one may be mounted."""
    place = tmp_path / "disk"
    place.mkdir()

    def mount(options):
        command = ["mount", "-t", "tmpfs", "-o", options, "none", str(place)]
        if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
            pytest.skip("no disk can be mounted here")
        return place

    yield mount
    subprocess.run(["umount", "-l", str(place)], capture_output=True, check=False)


@pytest.fixture
def small_disk(disk):
    return disk("size=400k")


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ("ro", "Read-only file system"),
        ("nr_inodes=1", "No space left on device"),
        ("nr_inodes=4", "No space left on device"),
        ("size=4k", "No space left on device"),
    ],
)
@pytest.mark.parametrize("command", ["run", "sweep"])
def test_a_disk_without_room_is_one_sentence_and_is_left_as_it_was(cli, disk, command, options, reason):
    place = disk(options)
    jobs = ("--jobs", 0) if command == "sweep" else ()
    finished = cli(command, *QUICK, "record=scores", *jobs, "-o", place / "r")
    assert finished.code == 2, finished.stderr
    assert "Traceback" not in finished.stderr
    last = finished.stderr.splitlines()[-1]
    assert last.startswith("graspbench: ")
    assert reason in last
    assert str(place) in last
    assert not [path for path in place.rglob("*") if path.name == "result.json" or "partial" in path.name]


def test_a_disk_that_fills_stops_a_sweep_that_can_go_on(process, small_disk):
    command = ("sweep", *QUICK, "seed=range(0,3)", "-o", small_disk / "r")
    ballast = small_disk / "ballast"
    ballast.write_bytes(bytes(340_000))
    finished = process(*command)
    assert finished.code == 2, finished.stderr
    assert "No space left" in finished.stderr.splitlines()[-1]
    assert "Traceback" not in finished.stderr
    before = {path.parent.name for path in small_disk.glob("r/[!.]*/result.json")}
    assert not list(small_disk.glob("r/.*.partial"))
    ballast.unlink()
    finished = process(*command)
    assert finished.code == 0, finished.stderr
    assert f"{3 - len(before)} to run, {len(before)} there already" in finished.stderr
    assert pd.read_csv(small_disk / "r" / "trials.csv")["status"].tolist() == ["done"] * 3
