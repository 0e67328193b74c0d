"""The search over parameters: its grammar, and that it goes on where it was."""

import pytest

from graspbench.errors import ConfigurationError
from graspbench.results.store import ResultStore
from graspbench.sweep.grid import SweepOptions
from graspbench.sweep.tune import Axis, TuneOptions, run_tuning, split_axes
from tests.small import SMALL_TRIAL

SMALL = [*SMALL_TRIAL, "record=off"]


def test_intervals_are_told_from_the_grid():
    axes, grid = split_axes(
        [
            "object=teddy",
            "index.k_e=tag(log,interval(0.1,10))",
            "seed=0,1",
            "planner.planes=int(interval(1,8))",
        ]
    )
    assert axes == [
        Axis("index.k_e", 0.1, 10.0, whole=False, log=True),
        Axis("planner.planes", 1.0, 8.0, whole=True, log=False),
    ]
    assert grid == ["object=teddy", "seed=0,1"]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("object=teddy", "nothing to tune"),
        ("index.k_e=interval(2,1)", "empty interval"),
        ("index.k_e=tag(log,interval(0,1))", "no logarithm"),
        ("index.k_e=(", "cannot be read"),
    ],
)
def test_what_cannot_be_searched_is_refused(override, message):
    with pytest.raises(ConfigurationError, match=message):
        split_axes([override])


def test_a_search_goes_on_where_it_was_and_runs_no_trial_twice(tmp_path):
    axes, grid = split_axes(["index.k_e=interval(0.5,2)", *SMALL])
    store, seen = ResultStore(tmp_path / "tune"), []
    sweep = SweepOptions(jobs=0)
    for wanted in (2, 3):
        options = TuneOptions("local.q1", candidates=wanted)
        study = run_tuning(axes, grid, store, options, sweep, on_candidate=seen.append)
    assert [row["candidate"] for row in seen] == [0, 1, 2]
    assert len(store.results()) == 3
    scores = {float(f"{trial.params['index.k_e']:.6g}"): trial.value for trial in study.trials}
    for result in store.results():
        assert scores[result["index"]["k_e"]] == pytest.approx(result["local"]["q1"])


def test_an_unknown_measure_is_named(tmp_path):
    axes, grid = split_axes(["index.k_e=interval(0.5,2)", *SMALL])
    with pytest.raises(ConfigurationError, match=r"no column 'local\.q9'"):
        run_tuning(axes, grid, ResultStore(tmp_path), TuneOptions("local.q9"), SweepOptions(jobs=0))


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("index.k_e=interval(0,inf)", "is endless"),
        ("index.k_e=interval(-inf,inf)", "is endless"),
        ("index.k_e=interval(nan,1)", "is endless"),
        ("index.k_e=interval(1,1e300)", "is endless"),
    ],
)
def test_an_endless_interval_is_refused(override, message):
    with pytest.raises(ConfigurationError, match=message):
        split_axes([override])
