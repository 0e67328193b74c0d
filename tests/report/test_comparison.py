"""The table of local against global grasps: rows, means, notes."""

import numpy as np
import pandas as pd
import pytest

from graspbench.errors import LogError
from graspbench.report import comparison_table
from graspbench.report.tables import to_latex, to_markdown
from tests.report import latex


def frame(**changes):
    rows = []
    for k_cm in (0, 1):
        for name, fingers, scale in (("bottle", 4, 1.0), ("teddy", 3, 0.9), ("my_mug & 50% #1", 3, 0.8)):
            for seed in (0, 1):
                row = {
                    "status": "done", "object.name": name, "hand.name": "radial", "hand.fingers": fingers,
                    "index.name": "force_field", "index.k_cm": k_cm, "seed": seed,
                }  # fmt: skip
                for i, best in enumerate((0.4, 0.012, 0.3), start=1):
                    ratio = scale - 0.01 * i - 0.02 * k_cm + 0.004 * seed
                    row |= {f"local.q{i}": best * ratio, f"global.q{i}.value": best, f"ratio.q{i}": ratio}
                rows.append(row)
    return pd.DataFrame(rows).assign(**changes)


def test_rows_are_in_the_order_of_the_thesis():
    rows = comparison_table(frame()).rows
    assert [(row["k_cm"], row["object"]) for row in rows] == [
        (k, name) for k in (1.0, 0.0) for name in ("bottle", "my_mug & 50% #1", "teddy")
    ]


def test_trials_of_other_seeds_are_averaged_which_is_said():
    table = comparison_table(frame())
    row = table.rows[0]
    assert row["trials"] == 2
    assert row["q1_ratio"] == pytest.approx(1.0 - 0.01 - 0.02 + 0.002)
    assert row["q1_ratio_std"] == pytest.approx(0.004 / np.sqrt(2))
    assert row["q2_global"] == pytest.approx(0.012)
    assert "Pools trials that differ in seed." in table.notes


def test_thesis_ratios_stand_beside_its_own_objects_only():
    rows = {(row["k_cm"], row["object"]): row for row in comparison_table(frame()).rows}
    assert rows[1.0, "teddy"]["q2_ratio_thesis"] == pytest.approx(0.536 / 0.690)
    assert rows[0.0, "bottle"]["q3_ratio_thesis"] == pytest.approx(0.574 / 0.590)
    assert rows[0.0, "my_mug & 50% #1"]["q1_ratio_thesis"] is None
    other = comparison_table(frame(**{"index.name": "mirtich_canny"}))
    assert not any(column.key.endswith("thesis") for column in other.columns)


def test_failed_trials_are_counted_but_not_averaged():
    trials = frame()
    trials.loc[trials["seed"] == 1, "status"] = "failed"
    trials.loc[trials["seed"] == 1, "ratio.q1"] = np.nan
    table = comparison_table(trials)
    assert (table.rows[0]["trials"], table.rows[0]["failed"]) == (1, 1)
    assert table.rows[0]["q1_ratio"] == pytest.approx(0.97)
    assert "Of 12 trials 6 failed: not in the means." in table.notes


def test_trials_that_cannot_be_read_are_counted():
    unreadable = pd.DataFrame([{"trial_id": "x", "status": "unreadable"}])
    table = comparison_table(pd.concat([frame(), unreadable], ignore_index=True))
    assert len(table.rows) == 6
    assert "Of 13 trials 1 unreadable: not in the means." in table.notes
    assert comparison_table(pd.concat([frame()[:0], unreadable])).rows == ()


def test_trials_without_global_search_have_local_values_only():
    trials = frame().drop(columns=[c for c in frame() if c.startswith(("global", "ratio"))])
    keys = [column.key for column in comparison_table(trials).columns]
    assert [key for key in keys if key.startswith("q")] == ["q1_local", "q2_local", "q3_local"]


def test_an_index_without_the_gain_has_none_and_is_named():
    both = pd.concat(
        [frame(), frame(**{"index.name": "quality_ascent"}).drop(columns="index.k_cm")], ignore_index=True
    )
    table = comparison_table(both)
    gains = {row["index"]: set() for row in table.rows}
    for row in table.rows:
        gains[row["index"]].add(row["k_cm"])
    assert gains == {"force_field": {0.0, 1.0}, "quality_ascent": {None}}
    lines = [line for line in to_markdown(table).splitlines() if line.startswith("| quality")]
    assert all(line.startswith(r"| quality\_ascent | - | ") for line in lines)
    alone = comparison_table(both[both["index.name"] == "quality_ascent"])
    assert "k_cm" not in [column.key for column in alone.columns]


def test_bold_is_within_an_object_only():
    table = comparison_table(frame())
    best = table.best_cells()
    assert {table.rows[i]["k_cm"] for i, _ in best} == {0.0}
    assert len(best) == 3 * 3


@pytest.mark.skipif(not latex.AVAILABLE, reason=latex.REASON)
@pytest.mark.parametrize("thesis", [True, False])
def test_latex_compiles_and_fits(tmp_path, thesis):
    trials = frame() if thesis else frame(**{"index.name": "a_b<c"})
    log = latex.compiled(tmp_path, to_latex(comparison_table(trials)))
    assert "Overfull" not in log


def test_no_trials_are_refused():
    with pytest.raises(LogError, match="the trials are none"):
        comparison_table(frame().iloc[:0])
    with pytest.raises(LogError, match=r"lack the column object\.name"):
        comparison_table(pd.DataFrame({"status": ["done"]}))
