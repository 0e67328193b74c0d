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


def test_trials_are_paired_by_what_varies_inside_the_experiments():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    second = second.sample(frac=1.0, random_state=0)
    table, keys = compare_experiments(first, second)
    assert keys == ["object.name", "seed"]
    row = table.set_index("value").loc["local.q1"]
    ordered = second.sort_values(["object.name", "seed"])["local.q1"].to_numpy()
    difference = ordered - first["local.q1"].to_numpy()
    assert row["pairs"] == 20
    assert row["difference"] == pytest.approx(difference.mean())
    assert row["p"] == pytest.approx(stats.wilcoxon(difference).pvalue)
    low, high = stats.t.interval(0.95, 19, difference.mean(), stats.sem(difference))
    assert row["ci"] == pytest.approx((high - low) / 2)


def test_success_is_compared_by_mcnemars_exact_test():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    row = compare_experiments(first, second)[0].set_index("value").loc["success"]
    assert (row["test"], row["better"], row["worse"]) == ("McNemar", 4, 0)
    assert row["p"] == pytest.approx(2 * 0.5**4)


def test_equal_experiments_do_not_differ():
    trials = experiment(0, 1, "force_field", "a")
    table, keys = compare_experiments(trials, trials)
    assert keys == ["trial_id"]
    assert (table["p"] == 1).all()
    assert (table["difference"] == 0).all()


def test_holms_correction_never_shrinks_and_keeps_the_order():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0.05, 2, "quality_ascent", "b")
    table, _ = compare_experiments(first, second)
    assert (table["p_holm"] >= table["p"]).all()
    smallest = table["p"].min()
    assert table["p_holm"].min() == pytest.approx(min(1.0, smallest * len(table)))


def test_experiments_without_a_common_trial_are_refused():
    first, second = experiment(0, 1, "force_field", "a"), experiment(0, 2, "force_field", "b")
    second["object.name"] = "mug"
    with pytest.raises(LogError, match="no trial of the first experiment has a partner"):
        compare_experiments(first, second)
