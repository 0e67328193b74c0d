"""What a sweep says while it runs."""

import gc
import importlib
import signal
import threading
import time
from unittest import mock

import pytest

from graspbench.cli import ending
from graspbench.cli.ending import end_on_signals, interruptible
from graspbench.cli.live_page import LivePage
from graspbench.cli.progress import SweepProgress
from graspbench.results.trial_result import TrialResult
from tests.small import SMALL_PICTURES


def result(trial_id, status="done", reason=None):
    return TrialResult(trial_id=trial_id, status=status, reason=reason)


def test_failures_are_shown_at_once_and_the_end_is_counted(capfd):
    with SweepProgress(3, {"b": "object=duck"}) as progress:
        progress.add(result("a"))
        progress.add(result("b", "crashed", "the trial's process ended by signal SIGSEGV.\nmore"))
        assert "crashed b object=duck the trial's process ended by signal SIGSEGV." in capfd.readouterr().err
        progress.add(result("c"))
    said = capfd.readouterr().err
    assert "3/3 trials" in said
    assert "1 not done" in said
    assert "more" not in said


def test_first_interrupt_asks_to_stop_and_the_second_ends():
    stop, before = threading.Event(), signal.getsignal(signal.SIGINT)
    with interruptible(stop):
        signal.raise_signal(signal.SIGINT)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_signal_in_the_midst_of_an_import_waits_for_its_end(monkeypatch, tmp_path):
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    (tmp_path / "a_slow_module.py").write_text(
        "import signal, time\nsignal.raise_signal(signal.SIGTERM)\ntime.sleep(0.2)\nLOADED = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    end_on_signals()
    try:
        assert importlib.import_module("a_slow_module").LOADED
        with pytest.raises(KeyboardInterrupt):
            time.sleep(5)
        # Whoever catches everything on the way does not hide it from a sweep.
        with pytest.raises(KeyboardInterrupt), interruptible(threading.Event()):
            pass
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        ending._asked.clear()


class Closing:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)


def lose_it_and_wait():
    Closing()
    time.sleep(5)


@pytest.mark.parametrize("in_the_background", [False, True])
def test_a_signal_where_nothing_can_be_raised_comes_again_and_prints_nothing(monkeypatch, in_the_background):
    told = []
    monkeypatch.setattr("sys.unraisablehook", lambda lost: told.append(lost.exc_type))
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    # Ctrl-C is ignored in a shell's background
    signal.signal(signal.SIGINT, signal.SIG_IGN if in_the_background else signal.default_int_handler)
    end_on_signals()
    try:
        with pytest.raises(KeyboardInterrupt):
            lose_it_and_wait()
        assert KeyboardInterrupt not in told
        with pytest.raises(KeyboardInterrupt), interruptible(threading.Event()):
            pass
        # A sweep that heard of it is not asked once more.
        time.sleep(3 * ending._AGAIN_S)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        ending._asked.clear()


class HalfMade:
    def __init__(self):
        signal.raise_signal(signal.SIGTERM)
        self.whole = True

    def __del__(self):
        del self.whole


def test_what_a_signal_left_half_made_is_no_news(monkeypatch):
    told = []
    monkeypatch.setattr("sys.unraisablehook", lambda lost: told.append(lost.exc_type))
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    end_on_signals()
    try:
        with pytest.raises(KeyboardInterrupt):
            HalfMade()
        gc.collect()
        assert told == []
        ending._asked.clear()  # without a signal it is news
        with pytest.raises(AttributeError):
            HalfMade.__del__(object.__new__(HalfMade))
        gc.collect()
        assert told == [AttributeError]
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        ending._asked.clear()


def test_an_ignored_hangup_stays_ignored():
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        end_on_signals()
        with interruptible(threading.Event()):
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def test_the_page_of_a_sweep_is_there_while_it_runs_and_says_so(cli, tmp_path):
    told, write = [], LivePage._write

    def spied(page, running):
        write(page, running)
        told.append((running, (tmp_path / "r/report/index.html").read_text().count('"running":null')))

    grid = ("experiment=quick", "object=sphere", *SMALL_PICTURES, "seed=0,1")
    with mock.patch.object(LivePage, "_write", spied):
        finished = cli("sweep", *grid, "--jobs", 0, "--live", "-o", tmp_path / "r")
    assert finished.code == 0, finished.stderr
    assert told[0] == ("running: 1 of 2 trials are there", 0)
    assert told[-1] == (None, 1)
    assert f"page      {(tmp_path / 'r/report/index.html').resolve()}" in finished.stderr
