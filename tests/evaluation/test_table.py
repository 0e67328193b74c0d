import numpy as np
import pytest

from graspbench.evaluation.table import bootstrap_interval, inversions, kendall_between


def test_tau_and_inversions_by_hand():
    # Of the pairs (1,2), (1,3), (2,3) the second column turns one round.
    rows = kendall_between({"a": np.array([1.0, 2.0, 3.0]), "b": np.array([1.0, 3.0, 2.0])})
    assert rows[0]["tau"] == pytest.approx(1 / 3)
    assert (rows[0]["inversions"], rows[0]["pairs"]) == (1, 3)


def test_ties_are_no_pairs_and_nothing_is_made_of_a_column_of_one_value():
    assert inversions([0.0, 0.0, 1.0], [2.0, 1.0, 0.0]) == {"inversions": 2, "pairs": 2}
    row = kendall_between({"a": np.ones(5), "b": np.arange(5.0)})[0]
    assert np.isnan(row["tau"])


def test_missing_values_are_left_out():
    row = kendall_between({"a": np.array([1.0, np.nan, 3.0, 4.0]), "b": np.array([1.0, 0.0, 3.0, 4.0])})[0]
    assert (row["grasps"], row["tau"]) == (3, pytest.approx(1.0))


def test_the_bootstrap_interval_narrows_as_the_normal_one():
    sample = np.random.default_rng(1).normal(2.0, 1.0, 400)
    low, high = bootstrap_interval(sample)
    half = 1.96 * sample.std() / 20.0
    assert low == pytest.approx(sample.mean() - half, abs=0.2 * half)
    assert high == pytest.approx(sample.mean() + half, abs=0.2 * half)
    assert bootstrap_interval(sample) == (low, high)
