"""What a trial says while a stage lasts."""

import re
import time

import numpy as np

from graspbench.cli import progress, ticker
from graspbench.cli.progress import SweepProgress
from graspbench.cli.stages import stage_activity
from graspbench.cli.ticker import Saying, Ticker
from graspbench.config.trial_config import load_config
from graspbench.planning import SearchParameters, plan_global
from graspbench.trial.clock import StageClock, Watch
from graspbench.trial.warm_up import _ball


def test_a_stage_that_lasts_says_so_with_its_seconds(capfd, monkeypatch):
    monkeypatch.setattr(ticker, "_FIRST_S", 0.2)
    monkeypatch.setattr(ticker, "_LOOK_S", 0.05)
    watch = Watch()
    with Ticker(lambda: stage_activity(watch)):
        clock = StageClock(watch=watch)
        clock.run("short", lambda: None)
        with clock.stage("long"):
            time.sleep(0.5)
    said = capfd.readouterr().err
    assert re.search(r"\.\.\. long for \d s so far", said)
    assert "short for" not in said


def test_the_global_search_tells_its_gap():
    watch = Watch()
    with watch.at("global_q3"):
        quality, search = load_config().quality, SearchParameters(time_limit_s=0.3, measures=("q3",))
        found = plan_global(_ball(), "q3", 3, quality, search, on_begin=watch.follow)
        told = stage_activity(watch)
        assert told.name == "global_q3"
        assert watch.search.best == found.value
        assert watch.search.upper_bound == found.upper_bound_up_to_solver
        watch.search.best = -np.inf
        assert "no grasp yet" in stage_activity(watch).more
        watch.search.best, watch.search.upper_bound = 0.1, 0.4
        assert stage_activity(watch).more == ("best 0.1", "at most 0.4", "gap 75 %")
    assert stage_activity(watch) is None
    assert watch.search is None


def test_a_sweep_without_a_terminal_says_what_it_waits_for(capfd, monkeypatch):
    monkeypatch.setattr(progress, "_QUIET_S", 0.1)
    monkeypatch.setattr(ticker, "_LOOK_S", 0.05)
    with SweepProgress(3, {}):
        time.sleep(0.3)
    assert "0/3 trials: the next for 0 s so far" in capfd.readouterr().err
    assert progress.err is ticker.err


def test_an_experiment_says_how_long_it_has_been_at_something(capfd, monkeypatch):
    monkeypatch.setattr(ticker, "_FIRST_S", 0.1)
    monkeypatch.setattr(ticker, "_LOOK_S", 0.05)
    with Saying("table-3.1") as saying:
        saying.say("teddy: planned")
        time.sleep(0.3)
    said = capfd.readouterr().err
    assert "teddy: planned\n" in said
    assert "... the work after 'teddy: planned' for 0 s so far" in said
