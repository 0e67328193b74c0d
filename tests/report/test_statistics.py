"""Intervals and correlations against published and library values."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from graspbench.errors import ConfigurationError
from graspbench.report import aggregate, spearman, wilson_interval


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_interval_is_scipys(case):
    successes, trials = case
    ours = wilson_interval(successes, trials)
    theirs = stats.binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-12)
    assert ours.low <= ours.value <= ours.high


def test_no_trial_says_nothing_about_a_rate():
    interval = wilson_interval(0, 0)
    assert (interval.low, interval.high) == (0.0, 1.0)
    assert np.isnan(interval.value)


@given(st.integers(0, 10**6), st.integers(5, 40))
def test_spearman_is_scipys_and_lies_in_its_interval(seed, n):
    generator = np.random.default_rng(seed)
    x, y = generator.integers(0, 12, n).astype(float), generator.normal(size=n)
    ours = spearman(x, y)
    if np.ptp(x) == 0:
        assert np.isnan(ours.value)
        return
    assert ours.value == pytest.approx(stats.spearmanr(x, y).statistic, abs=1e-12)
    assert ours.low <= ours.value <= ours.high


def test_spearman_interval_covers_as_often_as_it_says():
    generator = np.random.default_rng(1)
    rho = 0.6
    true = 6 / np.pi * np.arcsin(rho / 2)  # of the bivariate normal
    pairs = generator.multivariate_normal([0, 0], [[1, rho], [rho, 1]], size=(1500, 60))
    intervals = [spearman(p[:, 0], p[:, 1]) for p in pairs]
    assert np.mean([i.low <= true <= i.high for i in intervals]) == pytest.approx(0.95, abs=0.02)


def test_spearman_leaves_missing_pairs_out():
    x = np.array([1.0, 2, 3, 4, 5, np.nan, 7])
    y = np.array([2.0, 1, 4, 3, 5, 0, np.inf])
    assert spearman(x, y) == spearman(x[:5], y[:5])


def test_too_few_pairs_estimate_nothing():
    interval = spearman(np.arange(3.0), np.arange(3.0))
    assert np.isnan(interval.value)
    assert (interval.low, interval.high) == (-1.0, 1.0)


def test_aggregate_by_short_names():
    trials = pd.DataFrame(
        {"object.name": ["b", "a", "a", "a"], "index.k_cm": [0, 0, 0, 1], "local.q1": [0.1, 0.2, 0.4, np.nan]}
    )
    table = aggregate(trials, ["object", "index.k_cm"], ["local.q1"], ["mean", "std", "ci", "count"])
    assert table["object.name"].tolist() == ["a", "a", "b"]
    assert table["trials"].tolist() == [2, 1, 1]
    np.testing.assert_allclose(table["local.q1.mean"], [0.3, np.nan, 0.1])
    np.testing.assert_allclose(table["local.q1.std"], [np.sqrt(0.02), np.nan, np.nan])
    half = stats.t.interval(0.95, 1, 0.3, np.sqrt(0.02 / 2))[1] - 0.3
    np.testing.assert_allclose(table["local.q1.ci"], [half, np.nan, np.nan])
    assert table["local.q1.count"].tolist() == [2, 0, 1]


def test_unknown_column_or_statistic_is_named():
    trials = pd.DataFrame({"object.name": ["a"], "x": [1.0]})
    with pytest.raises(ConfigurationError, match="no column 'hand'"):
        aggregate(trials, ["hand"], ["x"], ["mean"])
    with pytest.raises(ConfigurationError, match="unknown statistic 'mode'"):
        aggregate(trials, ["object"], ["x"], ["mode"])
