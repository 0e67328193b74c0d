"""What a process beside does is what would have been done here, whatever becomes of that process."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from graspbench.beside import Beside

HERE = "tests.test_beside"


def where(factor: int, numbers: list[int]) -> tuple[int, list[int]]:
    print("a library prints")
    return os.getpid(), [factor * number for number in numbers]


def refuse(word: str) -> None:
    raise ValueError(word)


def take(_thing: object) -> int:
    return os.getpid()


def die_elsewhere(parent: int) -> str:
    if os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


def stay(pid_file: Path, seconds: float = 60.0) -> None:
    pid_file.write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(seconds)


def test_work_is_done_in_another_process_or_here():
    results = {}
    for wanted in (True, False):
        with Beside(HERE, wanted) as beside:
            beside.start("where", 3, [1, 2])
            [(process, results[wanted])] = beside.results()
        assert (process == os.getpid()) is not wanted
    assert results[True] == results[False] == [3, 6]


def test_pieces_of_work_are_done_in_their_order_while_more_may_come(tmp_path):
    with Beside(HERE) as beside:
        beside.start("stay", tmp_path / "pid", 0.0)
        first = _pid_in(tmp_path / "pid")
        beside.start("where", 1, [5])
        assert beside.results() == [None, (first, [5])]


def test_an_error_is_raised_here():
    with Beside(HERE) as beside:
        beside.start("refuse", "so it is")
        with pytest.raises(ValueError, match="so it is"):
            beside.results()


def test_what_cannot_be_pickled_is_done_here():
    with Beside(HERE) as beside:
        beside.start("take", lambda: None)
        assert beside.results() == [os.getpid()]


def test_a_process_that_dies_is_made_good():
    with Beside(HERE) as beside:
        beside.start("die_elsewhere", os.getpid())
        assert beside.results() == ["done"]


def test_without_a_place_for_a_process_it_is_done_here(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    with Beside(HERE) as beside:
        beside.start("take", 0)
        assert beside.results() == [os.getpid()]


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def _pid_in(file: Path) -> int:
    end = time.monotonic() + 30.0
    while not (file.exists() and file.read_text(encoding="utf-8")):
        assert time.monotonic() < end
        time.sleep(0.02)
    return int(file.read_text(encoding="utf-8"))


def _ends(pid: int) -> bool:
    end = time.monotonic() + 30.0
    while _alive(pid) and time.monotonic() < end:
        time.sleep(0.02)
    return not _alive(pid)


def test_it_ends_with_the_block(tmp_path):
    with Beside(HERE) as beside:
        beside.start("stay", tmp_path / "pid")
        pid = _pid_in(tmp_path / "pid")
    assert not _alive(pid)


def test_it_ends_with_its_parent_even_one_that_is_killed(tmp_path):
    program = (
        "import sys, time",
        "from pathlib import Path",
        "from graspbench.beside import Beside",
        f"beside = Beside({HERE!r})",
        "beside.start('stay', Path(sys.argv[1]))",
        "time.sleep(60.0)",
    )
    arguments = [sys.executable, "-c", "\n".join(program), str(tmp_path / "pid")]
    with subprocess.Popen(arguments, cwd=Path(__file__).parents[1]) as parent:
        pid = _pid_in(tmp_path / "pid")
        parent.kill()
    assert _ends(pid)
