"""Tables of one's own grouping, and correlations."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from graspbench.errors import ConfigurationError
from graspbench.report.correlations import correlation_table
from graspbench.report.groups import group_table
from graspbench.report.statistics import wilson_interval
from graspbench.report.tables import to_latex, to_markdown
from tests.report import latex


@pytest.fixture
def trials():
    generator = np.random.default_rng(3)
    quality = generator.uniform(0, 1, 60)
    return pd.DataFrame(
        {
            "status": "done",
            "trial_id": [f"{k:010x}" for k in range(60)],
            "object.name": ["duck", "teddy_1"] * 30,
            "index.k_cm": [0.0, 0.0, 1.0, 1.0] * 15,
            "success": quality > 0.2,
            "local.q1": quality,
            "local.time_s": 0.1 + 0.01 * np.arange(60),
            "execution.phases.lift.slip_m": 0.01 * (1 - quality),
        }
    )


def test_groups_hold_means_and_wilsons_rates(trials):
    table = group_table(trials, ["object", "k_cm"], ["mean", "count"], ["q1"])
    assert [column.key for column in table.columns[:3]] == ["object.name", "index.k_cm", "trials"]
    assert len(table.rows) == 4
    first = trials[(trials["object.name"] == "duck") & (trials["index.k_cm"] == 0)]
    row = table.rows[0]
    assert row["local.q1.mean"] == pytest.approx(first["local.q1"].mean())
    rate = wilson_interval(int(first["success"].sum()), len(first))
    assert (row["success.rate"], row["success.low"], row["success.high"]) == pytest.approx(
        (rate.value, rate.low, rate.high)
    )


def test_trials_without_success_are_left_out_of_the_rate_and_counted(trials):
    trials["success"] = trials["success"].astype(object).where(trials["local.q1"] > 0.5, None)
    table = group_table(trials, ["object"], ["mean"], ["local.q1"])
    known = trials[trials["local.q1"] > 0.5].groupby("object.name").size()
    assert [row["success.trials"] for row in table.rows] == known.tolist()
    assert [row["success.rate"] for row in table.rows] == [1.0, 1.0]
    unknown = len(trials) - known.sum()
    assert any(f"Success is empty in {unknown} of 60 trials" in note for note in table.notes)


def test_a_rate_of_nothing_is_empty(trials):
    trials["success"] = trials["success"].astype(object).where(trials["object.name"] == "duck", None)
    duck, teddy = group_table(trials, ["object"], ["mean"]).rows
    assert duck["success.rate"] is not None
    assert (teddy["success.rate"], teddy["success.low"], teddy["success.trials"]) == (None, None, 0)
    trials["success"] = None
    assert "success.rate" not in group_table(trials, ["object"], ["mean"]).rows[0]


def test_what_is_pooled_is_named(trials):
    trials["camera.width"] = [320, 640] * 30
    trials["choice.surface"] = ["thesis", "thesis", "thesis", "smooth"] * 15
    by_object = group_table(trials, ["object"], ["mean"]).notes
    assert "Pools trials that differ in choice.surface, index.k_cm." in by_object
    by_gain = group_table(trials, ["k_cm"], ["mean"]).notes
    assert "Pools trials that differ in object.name, choice.surface, camera.width." in by_gain


def test_column_that_is_not_there_is_refused_with_near_ones(trials):
    with pytest.raises(ConfigurationError, match=r"no column 'local\.q7': choose from local\.q1"):
        group_table(trials, ["object"], ["mean"], ["local.q7"])


def test_correlation_finds_the_order_and_corrects_for_the_number_of_pairs(trials):
    table = correlation_table(trials)
    rows = {row["outcome"]: row for row in table.records}
    slip = rows["execution.phases.lift.slip_m"]
    assert slip["rho"] == pytest.approx(-1.0)
    assert slip["low"] <= slip["rho"] <= slip["high"]
    assert rows["success"]["rho"] > 0.5
    expected = stats.false_discovery_control([row["p"] for row in table.records])
    assert [row["p_corrected"] for row in table.records] == pytest.approx(list(expected))
    assert rows["success"]["p"] == pytest.approx(
        stats.spearmanr(trials["local.q1"], trials["success"]).pvalue
    )


def test_correlations_are_shown_as_outcomes_by_qualities(trials):
    table = correlation_table(trials)
    assert [row["outcome"] for row in table.rows] == ["success", "execution.phases.lift.slip_m"]
    assert r"| slip in lift | -1.00\* |" in to_markdown(table)


def test_correlation_leaves_out_trials_that_were_not_executed(trials):
    executed = correlation_table(trials[:40])
    trials["success"] = trials["success"].astype(object)
    trials.loc[40:, ["success", "execution.phases.lift.slip_m"]] = None
    table = correlation_table(trials)
    assert table.records == executed.records
    assert any("20 of 60" in note for note in table.notes)


def test_best_mean_is_bold_within_an_object_smallest_for_times(trials):
    table = group_table(trials, ["object", "k_cm"], ["mean"], ["local.q1", "local.time_s"])
    best = table.best_cells()
    for name in ("duck", "teddy_1"):
        rows = [i for i, row in enumerate(table.rows) if row["object.name"] == name]
        fast = min(rows, key=lambda i: table.rows[i]["local.time_s.mean"])
        assert [i for i, key in best if key == "local.time_s.mean" and i in rows] == [fast]
    assert group_table(trials, ["object"], ["mean"]).best_cells() == frozenset()


def test_correlation_leaves_out_trials_that_executed_another_grasp_than_the_planned_one(trials):
    planned = correlation_table(trials[:40])
    trials["strengthened.q3"] = np.where(np.arange(60) < 40, np.nan, 0.3)
    trials.loc[40:, "execution.phases.lift.slip_m"] = 0.5
    table = correlation_table(trials)
    assert table.data == planned.data
    assert "20 trials are left out that executed a strengthened or explored grasp." in table.notes


def test_a_spread_stands_behind_the_mean(trials):
    text = to_markdown(group_table(trials, ["object"], ["mean", "std", "median"], ["local.q1"]))
    duck = trials.loc[trials["object.name"] == "duck", "local.q1"]
    assert f"| duck | 30 | {duck.mean():.3f} ± {duck.std():.3f} | {duck.median():.3f} |" in text


@pytest.mark.skipif(not latex.AVAILABLE, reason=latex.REASON)
def test_latex_compiles_and_fits(trials, tmp_path):
    values = ["local.q1", "local.time_s", "execution.phases.lift.slip_m"]
    table = group_table(trials, ["object", "k_cm"], ["mean", "ci", "median", "min", "max"], values)
    log = latex.compiled(tmp_path, to_latex(table), to_latex(correlation_table(trials)))
    assert "Overfull" not in log
