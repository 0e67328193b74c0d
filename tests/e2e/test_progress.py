"""What a sweep says while it runs."""

import signal
import threading

import pytest

from graspbench.cli.progress import SweepProgress, interruptible
from graspbench.results.trial_result import TrialResult


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
