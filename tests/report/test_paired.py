"""Paired comparison of two experiments against scipy and by hand."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from graspbench.errors import LogError
from graspbench.report.paired import compare_experiments


def experiment(shift, seed, index, ids):
    generator = np.random.default_rng(seed)
    rows = [(name, k) for name in ("duck", "teddy") for k in range(10)]
    base = np.array([0.3 + 0.01 * k + 0.1 * (name == "teddy") for name, k in rows])
    return pd.DataFrame(
        {
            "trial_id": [f"{ids}{k:09x}" for k in range(20)],
            "object.name": [name for name, _ in rows],
            "seed": [k for _, k in rows],
            "index.name": index,
            "index.k_cm": 1.0,
            "success": [k % 5 != 0 for _, k in rows] if shift == 0 else True,
            "local.q1": base + shift + 0.02 * generator.normal(size=20),
        }
    )


def by_value(table):
    return {row["value"]: row for row in table.rows}


def test_trials_are_paired_by_what_varies_inside_the_experiments():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    second = second.sample(frac=1.0, random_state=0)
    table = compare_experiments(first, second)
    assert table.notes[0].startswith("Paired by object.name, seed;")
    assert "A and B differ in index.name." in table.notes
    row = by_value(table)["local.q1"]
    ordered = second.sort_values(["object.name", "seed"])["local.q1"].to_numpy()
    difference = ordered - first["local.q1"].to_numpy()
    assert row["pairs"] == 20
    assert row["difference"] == pytest.approx(difference.mean())
    assert row["p"] == pytest.approx(stats.wilcoxon(difference).pvalue)
    low, high = stats.t.interval(0.95, 19, difference.mean(), stats.sem(difference))
    assert row["ci"] == pytest.approx((high - low) / 2)


def test_success_is_compared_by_mcnemars_exact_test():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    row = by_value(compare_experiments(first, second))["success"]
    assert (row["test"], row["higher"], row["lower"]) == ("McNemar", 4, 0)
    assert row["p"] == pytest.approx(2 * 0.5**4)


def test_equal_experiments_do_not_differ():
    trials = experiment(0, 1, "force_field", "a")
    table = compare_experiments(trials, trials)
    assert table.notes[0].startswith("Paired by trial_id;")
    assert {row["p"] for row in table.rows} == {1.0}
    assert {row["difference"] for row in table.rows} == {0.0}


def test_p_values_are_corrected_for_their_number():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    rows = compare_experiments(first, second).rows
    expected = stats.false_discovery_control([row["p"] for row in rows])
    assert [row["p_corrected"] for row in rows] == pytest.approx(list(expected))


def test_trials_that_are_averaged_are_counted_with_what_they_differ_in():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    again = first.assign(trial_id=first["trial_id"].str.replace("a", "c"), **{"camera.width": 320})
    doubled = pd.concat([first.assign(**{"camera.width": 640}), again[:6]], ignore_index=True)
    table = compare_experiments(doubled, second)
    assert any(
        note.startswith("A: 12 of 26 trials, which differ in camera.width, are averaged to 6")
        for note in table.notes
    )
    assert by_value(table)["local.q1"]["pairs"] == 20


def test_trials_without_a_partner_and_pairs_without_a_value_are_counted():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    second["success"] = second["success"].astype(object)
    second.loc[[0, 3], "success"] = None
    table = compare_experiments(first, second[:15])
    assert by_value(table)["success"]["pairs"] == 13
    assert "Without a partner and left out: 5 of A." in table.notes
    assert "Pairs left out because a value is empty: success 2 of 15." in table.notes


def test_experiments_without_a_common_trial_are_refused():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0, 2, "force_field", "b")
    second["object.name"] = "mug"
    with pytest.raises(LogError, match="no trial of the first experiment has a partner"):
        compare_experiments(first, second)
