"""The study of what measures foretell: its statistics, its table, and the command on a small table."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

from graspbench.errors import ConfigurationError
from graspbench.paper.quality_study import quality_study
from graspbench.paper.study.analysis import BEST, COMBINED
from graspbench.paper.study.cases import case
from graspbench.paper.study.combination import Features, fitted, logistic, ridge
from graspbench.paper.study.statistics import (
    areas_under_curve,
    bootstrapped,
    folds_of,
    held_out,
    once,
    rank_correlations,
)
from graspbench.paper.study.table import KEPT, read_table, with_rows, write_table


def made_up(grasps=240, objects=24, seed=0):
    """A table in which q3 and the joint margin together decide, and q1 is noise."""
    rng = np.random.default_rng(seed)
    q3, margin, noise = rng.uniform(size=(3, grasps))
    strength = 4.0 * (q3 + margin - 0.6) + 0.3 * rng.normal(size=grasps)
    rows = []
    for k in range(grasps):
        force = max(0.0, strength[k])
        rows.append(
            {
                "case": k % objects,
                "object": f"object_{k % objects}",
                "hand": ("radial", "allegro")[k % 2],
                "stratum": "low",
                "friction": (0.35, 0.8)[k // 2 % 2],
                "mass_kg": 0.15,
                "q1": noise[k],
                "q3": q3[k],
                "joint_margin": margin[k],
                "held": force > 0.0,
                "reason": None,
                "forces_weight": force + np.arange(14.0),
                "torques_weight": force + np.arange(6.0),
                "points": np.zeros(9),
                "normals": np.zeros(9),
            }
        )
    return with_rows(None, rows)


def test_rank_correlation_is_spearmans():
    rng = np.random.default_rng(1)
    a = rng.integers(0, 9, 50).astype(float)
    b = a + rng.normal(size=50) * 3
    assert once(rank_correlations, a, b) == pytest.approx(spearmanr(a, b).statistic)
    assert np.isnan(once(rank_correlations, np.ones(9), b[:9]))
    a[3] = np.nan
    assert once(rank_correlations, a, b) == pytest.approx(
        spearmanr(np.delete(a, 3), np.delete(b, 3)).statistic
    )


def test_area_under_curve_counts_pairs():
    rng = np.random.default_rng(2)
    predicted, good = rng.integers(0, 6, 40).astype(float), rng.random(40) < 0.4
    pairs = [1.0 if a > b else 0.5 if a == b else 0.0 for a in predicted[good] for b in predicted[~good]]
    assert once(areas_under_curve, predicted, good.astype(float)) == pytest.approx(np.mean(pairs))
    assert np.isnan(once(areas_under_curve, predicted, np.ones(40)))


def test_samples_are_scored_as_if_their_rows_were_there_so_often():
    rng = np.random.default_rng(6)
    a, b = rng.integers(0, 7, (2, 30)).astype(float)
    counts = rng.integers(0, 4, (25, 30)).astype(float)
    good = (b > 3).astype(float)
    for score, outcome in ((rank_correlations, b), (areas_under_curve, good)):
        for sample, value in zip(counts, score(a, outcome, counts), strict=True):
            rows = np.repeat(np.arange(30), sample.astype(int))
            assert value == pytest.approx(once(score, a[rows], outcome[rows]))


def test_intervals_are_over_objects_not_over_grasps():
    # Ten copies of each grasp tell nothing new: the interval stays as wide.
    rng = np.random.default_rng(3)
    a = rng.normal(size=30)
    b, objects = a + rng.normal(size=30), np.array([f"o{k}" for k in range(30)])
    alone = bootstrapped(rank_correlations, a, b, objects)
    copied = bootstrapped(rank_correlations, np.repeat(a, 10), np.repeat(b, 10), np.repeat(objects, 10))
    assert copied.high - copied.low == pytest.approx(alone.high - alone.low, rel=0.1)
    assert alone.low < alone.value < alone.high


def test_no_object_is_in_two_folds_and_nothing_is_fitted_to_what_is_held_out():
    objects = np.array([f"o{k % 13}" for k in range(100)])
    folds = folds_of(objects, 5)
    for name in np.unique(objects):
        assert len(set(folds[objects == name])) == 1
    assert set(folds) == set(range(5))

    def fit(train):
        seen = set(objects[train])
        return lambda rows: np.array([float(name in seen) for name in objects[rows]])

    assert np.all(held_out(fit, folds) == 0.0)


@pytest.mark.parametrize("strength", [0.3, 30.0])
def test_the_logistic_combination_is_at_its_optimum(strength):
    rng = np.random.default_rng(4)
    features = Features({name: rng.normal(size=60) for name in "abc"})
    everything = np.ones(60, dtype=bool)
    x = features.scaled(everything, everything)
    y = np.where(x[:, 0] + 0.4 * rng.normal(size=60) > 0, 1.0, 0.0)
    odds = logistic(features, y, strength, everything)(everything)
    # Stationary: the gradient of the likelihood is the regularisation's, found back from the odds.
    w, *_ = np.linalg.lstsq(np.column_stack((x, np.ones(60))), odds, rcond=None)
    residual = y - 1.0 / (1.0 + np.exp(-odds))
    np.testing.assert_allclose(x.T @ residual, strength * w[:3], atol=2e-3)
    assert abs(residual.sum()) < 2e-3


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """The study of a made-up table: what it says, and its folder."""
    output = tmp_path_factory.mktemp("study")
    write_table(made_up(), output / "grasps.parquet")
    return quality_study(output, (), 1, None, lambda _: None), output


def test_the_combination_finds_what_decides_together_and_the_best_alone_does_not(studied):
    rows = {row["predictor"]: row for row in studied[0].document["rows"]}
    assert rows[COMBINED]["spearman"] > rows[BEST]["spearman"] + 0.1
    assert rows[COMBINED]["auc"] > 0.9 > rows["q3"]["auc"]
    assert abs(rows["q1"]["spearman"]) < 0.2
    for row in rows.values():
        assert row["spearman.low"] <= row["spearman"] <= row["spearman.high"]


def test_chance_is_not_sold_as_skill():
    frame = made_up()
    rng = np.random.default_rng(5)
    objects = frame["object"].to_numpy(dtype=str)
    features = Features({str(k): rng.normal(size=len(frame)) for k in range(12)})
    outcome = rng.normal(size=len(frame))
    predicted = held_out(lambda train: fitted(ridge, features, outcome, objects, train), folds_of(objects, 5))
    assert abs(once(rank_correlations, predicted, outcome)) < 0.2


def test_the_table_is_stored_and_read_again(tmp_path):
    frame, path = made_up(), tmp_path / "grasps.parquet"
    write_table(frame, path)
    again = read_table(path)
    assert list(again.columns) == list(frame.columns)
    np.testing.assert_allclose(again["q3"], frame["q3"], rtol=1e-6)
    np.testing.assert_array_equal(np.stack(again["forces_weight"]), np.stack(frame["forces_weight"]))
    path.write_bytes(b"no table")
    with pytest.raises(ConfigurationError, match="cannot be read"):
        read_table(path)
    pd.DataFrame({"a": [1]}).to_parquet(path)
    with pytest.raises(ConfigurationError, match="no column 'case'"):
        read_table(path)


def test_cases_are_drawn_by_their_number_alone():
    first = [case(number) for number in range(120)]
    assert first == [case(number) for number in range(120)]
    assert len({each.object for each in first}) == 120
    assert len({each.friction for each in first}) == len({each.mass_kg for each in first}) == 3


def test_the_study_is_drawn_from_a_table_without_physics(studied):
    done, output = studied
    names = {path.name for path in output.iterdir()}
    assert {"predictors.md", "predictors.tex", "conditions.csv", "quality_study.png", "result.json"} <= names
    assert done.document["counts"]["grasps"] == 240
    assert done.document["counts"]["disturbances"] == 240 * 20
    with pytest.raises(ConfigurationError, match="takes no overrides"):
        quality_study(output, ("object=duck",), 1, None, lambda _: None)


def test_the_table_that_comes_with_graspbench_is_whole():
    frame = read_table(KEPT)
    assert KEPT.stat().st_size < 2e6
    assert frame["object"].nunique() >= 4
    assert set(frame["hand"]) == {"radial", "allegro", "radial_4"}
    assert all(len(each) == 14 for each in frame["forces_weight"])
    lost = ~frame["held"].to_numpy()
    assert all(np.max(each) == 0.0 for each in frame["forces_weight"][lost])
