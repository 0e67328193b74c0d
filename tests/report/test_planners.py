"""The leaderboard of planners and the table of planner by object."""

import numpy as np
import pandas as pd
import pytest

from graspbench.report.planners import planner_names, planner_tables
from graspbench.report.statistics import bootstrap_mean, wilson_interval


def trials():
    rows = []
    for planner, q3, held in (("default", 0.2, 3), ("random_closure", 0.1, 1), ("global_q3", 0.3, 2)):
        for k in range(6):
            found = not (planner == "random_closure" and k == 5)
            rows.append(
                {
                    "trial_id": f"{planner}{k}", "status": "done" if found else "failed", "seed": k,
                    "object.name": ("duck", "teddy")[k % 2], "hand.name": "radial", "hand.fingers": 3,
                    "index.name": "force_field", "choice.planner": planner,
                    "planned.planner": {"default": "parallel", "global_q3": "global"}.get(planner, planner),
                    "local.found_by": "follower" if planner == "default" else None,
                    "local.q1": 0.5 if found else np.nan, "local.q2": 1.0 if found else np.nan,
                    "local.q3": q3 + 0.01 * k if found else np.nan,
                    "planned.first_s": 0.1 * k if found else np.nan,
                    "planned.best_s": 0.2 * k if found else np.nan,
                    "planned.diversity_mm": np.nan, "success": k < held,
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def test_the_leaderboard_has_a_row_a_planner_best_first():
    leaderboard, _ = planner_tables(trials())
    rows = {row["planner"]: row for row in leaderboard.rows}
    assert [row["planner"] for row in leaderboard.rows] == ["parallel", "global_q3", "random_closure"]
    random = rows["random_closure"]
    assert random["found"] == pytest.approx(5 / 6)
    expected = wilson_interval(1, 6)
    assert (random["held"], random["held.low"], random["held.high"]) == pytest.approx(
        (expected.value, expected.low, expected.high)
    )
    assert random["q3"] == pytest.approx(0.1 + 0.01 * np.mean(range(5)))
    assert random["q3.low"] <= random["q3"] <= random["q3.high"]
    assert random["first_s"] == pytest.approx(0.2)
    assert random["diversity_mm"] is None


def test_the_other_table_has_a_column_a_planner():
    _, by_object = planner_tables(trials())
    assert [row["object"] for row in by_object.rows] == ["duck", "teddy"]
    duck = by_object.rows[0]
    assert duck["parallel"] == pytest.approx(2 / 3)
    assert len(by_object.records) == 6
    assert {row["planner"] for row in by_object.records} == {"parallel", "global_q3", "random_closure"}


def test_one_planner_has_no_leaderboard():
    frame = trials()
    assert planner_tables(frame[frame["choice.planner"] == "default"]) == []


def test_planners_that_climb_are_told_apart_by_the_index_where_there_are_several():
    frame = trials()
    assert set(planner_names(frame)) == {"parallel", "random_closure", "global_q3"}
    other = frame[frame["choice.planner"] == "default"].assign(**{"index.name": "quality_ascent"})
    names = set(planner_names(pd.concat((frame, other), ignore_index=True)))
    assert names == {"parallel, force_field", "parallel, quality_ascent", "random_closure", "global_q3"}


def test_trials_of_older_versions_are_the_local_planners():
    frame = trials().drop(columns=["choice.planner", "planned.planner"])
    assert set(planner_names(frame)) == {"parallel"}


def test_the_bootstrap_covers_the_mean_of_clusters():
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(200):
        centres = rng.normal(size=25)
        values = (centres[:, None] + 0.1 * rng.normal(size=(25, 4))).ravel()
        found = bootstrap_mean(values, [str(k) for k in np.repeat(np.arange(25), 4)])
        hits += found.low <= 0.0 <= found.high
    assert 0.88 <= hits / 200 <= 0.99
    assert np.isnan(bootstrap_mean(np.array([np.nan]), ["a"]).value)
    single = bootstrap_mean(np.array([2.0]), ["a"])
    assert single.value == 2.0
    assert np.isnan(single.low)
