"""The comparison of local and global grasps in the means of trials (thesis table 3.1)."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from graspbench.errors import LogError
from graspbench.report import columns as c
from graspbench.report.notes import status_notes, trial_notes
from graspbench.report.planners import planner_options
from graspbench.report.tables import SIGNIFICANT, Column, Table

TITLE = "Local against global grasps"

THESIS_3_1: dict[tuple[int, str], tuple[tuple[float, float], ...]] = {
    (1, "bottle"): ((0.016, 0.016), (0.091, 0.101), (0.438, 0.438)),
    (1, "teddy"): ((0.292, 0.320), (0.536, 0.690), (0.426, 0.482)),
    (0, "bottle"): ((0.019, 0.020), (0.099, 0.112), (0.574, 0.590)),
    (0, "teddy"): ((0.267, 0.297), (0.369, 0.413), (0.707, 0.780)),
}
"""(k_cm, object) -> (local, global) of Q1, Q2, Q3 as printed in thesis table 3.1.

Only the ratios can be set beside ours: the thesis does not say in which contact model and with which
unit of torque its values were taken.
"""

# Keys of the table's rows by the trials' columns.
_KEYS = {
    "planner": c.PLANNER_OPTION,
    "index": c.INDEX,
    "k_cm": c.GAIN,
    "object": c.OBJECT,
    "hand": c.HAND,
    "fingers": c.FINGERS,
}
_NEEDED = (c.OBJECT, c.HAND, c.FINGERS, c.INDEX, c.STATUS)
_FORMATS = {"k_cm": "g", "fingers": "g"}


def comparison_table(trials: pd.DataFrame) -> Table:
    """Gather trials into rows of thesis table 3.1: k_cm (1 first), then object.

    Trials of one index, k_cm, object and hand are averaged; what else they differ in is noted. Columns
    that are the same in every row stand in the notes instead.

    Args:
        trials: One row a trial, dotted column names as in ``trials.csv``.

    Raises:
        LogError: The table has no trial, or lacks the columns that name one.
    """
    trials = checked(trials)
    readable = trials[trials[c.STATUS] != c.UNREADABLE]
    given = readable.assign(**{c.PLANNER_OPTION: planner_options(readable)})
    keyed = given.assign(**{name: given.get(column) for name, column in _KEYS.items()})
    rows = [
        _row(dict(zip(_KEYS, key, strict=True)), group)
        for key, group in keyed.groupby(list(_KEYS), dropna=False, sort=True)
    ]
    rows.sort(key=_order)
    varying = [key for key in _KEYS if len({row[key] for row in rows}) > 1 or key == "object"]
    if any(row["k_cm"] is not None for row in rows):
        varying.append("k_cm")
    notes = (
        *_means_note(rows, varying),
        *status_notes(trials),
        *trial_notes(readable, tuple(_KEYS.values())),
    )
    return Table(
        "table",
        TITLE,
        _columns(rows, varying),
        tuple(rows),
        notes,
        compared=("object", "hand", "fingers"),
        parted=("planner", "index", "k_cm"),
    )


def checked(trials: pd.DataFrame) -> pd.DataFrame:
    """Return trials that have the columns which name one; those that could not be read have them empty.

    Raises:
        LogError: There are none, or a column is lacking.
    """
    missing = [name for name in _NEEDED if name not in trials]
    if missing or trials.empty:
        problem = f"lack the column {missing[0]}" if missing else "are none"
        raise LogError(f"the trials {problem}", remedy="give a folder that run or sweep has written")
    return trials


def thesis_ratio(gain: float | None, name: str, index: str, measure: str) -> float | None:
    """Return local over global as thesis table 3.1 has it; None where it has none."""
    if gain not in (0.0, 1.0) or index != "force_field" or (int(gain), name) not in THESIS_3_1:
        return None
    local, best = THESIS_3_1[int(gain), name][c.MEASURES.index(measure)]
    return local / best


def _row(key: Mapping[str, Any], group: pd.DataFrame) -> dict[str, Any]:
    done = group[group[c.STATUS] == c.DONE]
    row = {name: None if pd.isna(value) else value for name, value in key.items()}
    row |= {"trials": len(done), "failed": len(group) - len(done)}
    for measure in c.MEASURES:
        local, best, ratio = (
            c.numbers(done, name).dropna()
            for name in (f"local.{measure}", c.global_value(measure), f"ratio.{measure}")
        )
        row |= {
            f"{measure}_local": _mean(local),
            f"{measure}_global": _mean(best),
            f"{measure}_ratio": _mean(ratio),
            f"{measure}_ratio_std": float(ratio.std(ddof=1)) if len(ratio) > 1 else None,
            f"{measure}_ratio_thesis": thesis_ratio(
                row["k_cm"], str(row["object"]), str(row["index"]), measure
            ),
        }
    return row


def _mean(values: pd.Series) -> float | None:
    return float(values.mean()) if len(values) else None


def _order(row: Mapping[str, Any]) -> tuple[Any, ...]:
    gain = -1.0 if row["k_cm"] is None else -float(row["k_cm"])
    return (
        str(row["planner"]),
        str(row["index"]),
        gain,
        *(str(row[key]) for key in ("object", "hand")),
        str(row["fingers"]),
    )


def _columns(rows: list[dict[str, Any]], varying: list[str]) -> tuple[Column, ...]:
    columns = [Column(key, key, format=_FORMATS.get(key, "")) for key in _KEYS if key in varying]
    counts = {row["trials"] for row in rows} | {row["trials"] + row["failed"] for row in rows}
    if len(counts) > 1:
        columns.append(Column("trials", "n", format="d"))
    for measure in c.MEASURES:
        if all(row[f"{measure}_local"] is None for row in rows):
            continue
        group, searched = measure.upper(), any(row[f"{measure}_global"] is not None for row in rows)
        columns.append(Column(f"{measure}_local", "local", format=SIGNIFICANT, group=group))
        if not searched:
            continue
        columns += [
            Column(f"{measure}_global", "global", format=SIGNIFICANT, group=group),
            Column(
                f"{measure}_ratio", "ratio", format=".2f", group=group, spread=f"{measure}_ratio_std",
                best="largest",
            ),
        ]  # fmt: skip
        if any(row[f"{measure}_ratio_thesis"] is not None for row in rows):
            columns.append(Column(f"{measure}_ratio_thesis", "thesis", format=".2f", group=group))
    return tuple(columns)


def _means_note(rows: list[dict[str, Any]], varying: list[str]) -> tuple[str, ...]:
    if not rows:
        return ()
    counts = sorted({int(row["trials"]) for row in rows})
    n = f"n = {counts[0]}" if len(counts) == 1 else f"n = {counts[0]} to {counts[-1]}"
    common = [f"{key} {rows[0][key]}" for key in _KEYS if key not in varying and rows[0][key] is not None]
    notes = [f"Means over {n} trials a row{''.join(f'; {text}' for text in common)}."]
    if any(row[f"{measure}_ratio_std"] is not None for row in rows for measure in c.MEASURES):
        notes.append("Ratio: mean of local / global ± standard deviation.")
    if any(row[f"{measure}_ratio_thesis"] is not None for row in rows for measure in c.MEASURES):
        notes.append("Thesis: ratios of its table 3.1, which does not state its contact model: no values.")
    return tuple(notes)
