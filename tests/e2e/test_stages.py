"""What a trial says while a stage lasts."""

import re
import time

import numpy as np
import pytest

from graspbench.cli import progress, ticker
from graspbench.cli.progress import SweepProgress
from graspbench.cli.stages import stage_activity
from graspbench.cli.ticker import Saying, Ticker
from graspbench.config.trial_config import load_config
from graspbench.planning import SearchParameters, plan_global
from graspbench.trial.clock import StageClock, Watch
from graspbench.trial.warm_up import _ball
from tests.geometry.bad_meshes import ball
from tests.small import SMALL_PICTURES


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


def test_the_search_of_all_triples_tells_its_bound():
    watch = Watch()
    with watch.at("global_mirtich_canny"):
        quality = load_config().quality
        search = SearchParameters(time_limit_s=20.0, measures=("mirtich_canny",))
        bounds = []

        def begin(progress):
            watch.follow(progress)
            bounds.append(progress.upper_bound)

        found = plan_global(_ball(), "mirtich_canny", 3, quality, search, on_begin=begin)
        assert bounds == [np.inf]
        assert watch.search.best == found.value
        assert watch.search.upper_bound == found.upper_bound_up_to_solver
        assert f"best {found.value:.3g}" in stage_activity(watch).more


COMMANDS = {
    "report": ("report", "RESULTS", "--json"),
    "compare": ("report", "--compare", "RESULTS", "RESULTS", "--json"),
    "view": ("view", "RESULTS", "--no-open"),
    "export": ("export", "RESULTS", "-o", "OUT"),
    "evaluate": ("evaluate", "GRASPS", "-H", "radial", "-O", "sphere", "protocol=none"),
    "hands check": ("hands", "check", "radial", "--no-hold"),
    "hands show": ("hands", "show", "radial", "-o", "OUT"),
    "objects show": ("objects", "show", "sphere", "-o", "OUT"),
    "objects check": ("objects", "check", "MESH"),
    "log info": ("log", "info", "LOG"),
    "log recover": ("log", "recover", "LOG", "-o", "OUT"),
}


@pytest.fixture(scope="module")
def made(cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    trial = ("experiment=quick", "object=sphere", *SMALL_PICTURES)
    assert cli("run", *trial, "record=scores", "-o", folder / "r").code == 0
    assert cli("export", folder / "r", "-o", folder / "grasps.jsonl").code == 0
    ball(cells=2).export(folder / "ball.stl")
    (log,) = folder.glob("r/*/trial.mcap")
    return {
        "RESULTS": folder / "r",
        "GRASPS": folder / "grasps.jsonl",
        "MESH": folder / "ball.stl",
        "LOG": log,
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_that_may_last_says_so(cli, made, tmp_path, monkeypatch, command):
    """On a machine so slow that every look finds it at something that has lasted."""
    monkeypatch.setattr(ticker, "_FIRST_S", 0.0)
    monkeypatch.setattr(ticker, "_LOOK_S", 1e-4)
    monkeypatch.setattr(ticker.Ticker, "__exit__", _after_a_look)
    places = made | {"OUT": tmp_path / "out"}
    finished = cli(*(places.get(word, word) for word in COMMANDS[command]))
    assert finished.code in (0, 1), finished.stderr
    assert re.search(r"\.\.\. \S.* for \d+ s so far", finished.stderr)
    assert "so far" not in finished.stdout


def _after_a_look(self, *_, leave=ticker.Ticker.__exit__):
    time.sleep(0.05)
    leave(self)


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
