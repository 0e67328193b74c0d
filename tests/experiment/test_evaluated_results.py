"""Planners beside each other: their table and the order in which protocols put them."""

import pytest
from scipy.stats import kendalltau

from graspbench.experiment.evaluated_results import planner_ranks, planner_table

# Of four trials each: what planners a, b, c succeed in by two protocols; c plans one grasp less.
SUCCESSES = {"a": (4, 1), "b": (2, 2), "c": (1, 3)}


def rows():
    found = []
    for planner, (first, second) in SUCCESSES.items():
        for trial in range(4):
            planned = not (planner == "c" and trial == 3)
            found.append(
                {
                    "planner": planner,
                    "status": "done" if planned else "none",
                    "sound": planned,
                    "force_closure": planned and trial < 2,
                    "protocols": {"p": {"success": trial < first}, "q": {"success": trial < second}},
                }
            )
    return found


def test_every_trial_counts_for_its_planner_also_without_a_grasp():
    table = {row["planner"]: row for row in planner_table(rows(), ("p", "q"))}
    assert {name: row["grasps"] for name, row in table.items()} == {"a": 4, "b": 4, "c": 3}
    for name, (first, second) in SUCCESSES.items():
        row = table[name]
        assert (row["trials"], row["p"], row["q"]) == (4, first / 4, second / 4)
        for protocol in ("p", "q"):
            assert 0.0 <= row[f"{protocol}.low"] <= row[protocol] <= row[f"{protocol}.high"] <= 1.0
    assert table["c"]["sound"] == 0.75
    assert table["a"]["force_closure"] == 0.5


def test_protocols_that_order_planners_oppositely_are_told():
    (row,) = planner_ranks(rows(), ("p", "q"))
    columns = list(zip(*SUCCESSES.values(), strict=True))
    assert row["tau"] == pytest.approx(kendalltau(*columns).statistic) == -1.0
    assert (row["inversions"], row["pairs"]) == (3, 3)
