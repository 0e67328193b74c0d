"""Planners beside each other: a leaderboard over all objects, and a table of planner by object."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from graspbench.arrays import FloatArray
from graspbench.report import columns as c
from graspbench.report.notes import status_notes, trial_notes
from graspbench.report.statistics import Interval, bootstrap_mean, wilson_interval
from graspbench.report.tables import Column, Table
from graspbench.report.tables.model import Row

PLANNER = "planner"
_NAMED, _FOUND_BY = "planned.planner", "local.found_by"
_UNNAMED = ("default", "")
_MEANS = {
    **{measure: f"local.{measure}" for measure in c.MEASURES},
    "push": "execution.largest_push_weight",
    "diversity_mm": "planned.diversity_mm",
}
_MEDIANS = {"first_s": "planned.first_s", "best_s": "planned.best_s"}


def planner_options(trials: pd.DataFrame) -> "pd.Series[str]":
    """Return the option of each trial's planner.

    Trials of versions without planners to choose from are the local planner's.

    Args:
        trials: One row a trial.
    """
    chosen = trials.get(c.PLANNER_OPTION, pd.Series("", index=trials.index)).fillna("").astype(str)
    named = trials.get(_NAMED, pd.Series("", index=trials.index)).fillna("").astype(str)
    names = chosen.where(~chosen.isin(_UNNAMED), named)
    return names.where(names != "", "parallel")


def planner_names(trials: pd.DataFrame) -> list[str]:
    """Return the name of each trial's planner: the option chosen, with the index where several are climbed.

    Args:
        trials: One row a trial.
    """
    names = planner_options(trials)
    indices = trials.get(c.INDEX, pd.Series("", index=trials.index)).fillna("").astype(str)
    local = trials.get(_FOUND_BY, pd.Series(None, index=trials.index)).notna()
    climbing = {name for name in names.unique() if local[names == name].any()}
    several = len(set(indices[names.isin(climbing)])) > 1
    return [
        f"{name}, {index}" if several and name in climbing else name
        for name, index in zip(names, indices, strict=True)
    ]


def planner_tables(trials: pd.DataFrame) -> list[Table]:
    """Return the leaderboard and the table of planner by object; none where there is but one planner.

    Args:
        trials: One row a trial.
    """
    readable = trials[trials[c.STATUS] != c.UNREADABLE]
    named = readable.assign(**{PLANNER: planner_names(readable)})
    if named[PLANNER].nunique() < 2:
        return []
    executed = c.SUCCESS in named and bool(c.numbers(named, c.SUCCESS).notna().any())
    notes = (*status_notes(trials), *trial_notes(readable, (c.PLANNER_OPTION, c.OBJECT, c.HAND, c.FINGERS)))
    return [_leaderboard(named, executed, notes), _by_object(named, executed, notes)]


def _leaderboard(trials: pd.DataFrame, executed: bool, notes: Sequence[str]) -> Table:
    rows = [
        {"hand": hand, "fingers": fingers, PLANNER: name, **_summary(group)}
        for (hand, fingers, name), group in trials.groupby([c.HAND, c.FINGERS, PLANNER], sort=True)
    ]
    first = "held" if executed else "q3"
    rows.sort(key=lambda row: (str(row["hand"]), row["fingers"], *_descending(row, first, "q3")))
    return Table(
        "leaderboard",
        "Planners over all objects",
        (
            *_hand_columns(rows),
            Column(PLANNER, "planner"),
            Column("objects", "objects", format="d", narrow=False),
            Column("trials", "trials", format="d"),
            Column("found", "found", format=".2f", interval=("found.low", "found.high")),
            *((_rate_column(),) if executed else ()),
            *(_mean_column(measure, measure.upper(), ".3f") for measure in c.MEASURES),
            *((_mean_column("push", "push", ".1f", "weights"),) if _any(rows, "push") else ()),
            Column("first_s", "first grasp", "s", ".2f", best="smallest"),
            Column("best_s", "best grasp", "s", ".2f"),
            _mean_column("diversity_mm", "diversity", ".0f", "mm", best="", narrow=False),
        ),
        tuple(rows),
        (
            "Found: trials with a grasp that the hand holds. "
            + ("Held: of all trials, those whose object was held to the end. " if executed else "")
            + "Rates with Wilson's 95 % intervals. Q1 to Q3, pushes and diversity are means of the grasps "
            "found, with 95 % intervals by bootstrap over objects; times are medians since reconstruction "
            "began, which is part of them. Diversity: mean distance of contacts between the grasps found in "
            "a trial.",
            *notes,
        ),
        compared=("hand", "fingers"),
        parted=("hand", "fingers"),
    )


def _by_object(trials: pd.DataFrame, executed: bool, notes: Sequence[str]) -> Table:
    """Return a row an object and hand and a column a planner; the data have a row for each of all three."""
    data = [
        {"hand": hand, "fingers": fingers, "object": name, PLANNER: planner, **_summary(group)}
        for (hand, fingers, name, planner), group in trials.groupby(
            [c.HAND, c.FINGERS, c.OBJECT, PLANNER], sort=True
        )
    ]
    shown = "held" if executed else "q3"
    planners = sorted({str(row[PLANNER]) for row in data})
    rows: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in data:
        key = row["hand"], row["fingers"], row["object"]
        arranged = rows.setdefault(key, dict(zip(("hand", "fingers", "object"), key, strict=True)))
        name = str(row[PLANNER])
        arranged |= {
            name: row[shown],
            f"{name}.low": row[f"{shown}.low"],
            f"{name}.high": row[f"{shown}.high"],
        }
    what = "Success rate with Wilson's 95 % interval" if executed else "Mean Q3 with 95 % bootstrap interval"
    columns = [
        Column(name, name, format=".2f", interval=(f"{name}.low", f"{name}.high")) for name in planners
    ]
    return Table(
        "planners",
        "Planner by object",
        (*_hand_columns(list(rows.values())), Column("object", "object"), *columns),
        tuple(rows.values()),
        (f"{what}, of all trials of an object; further figures are in the data.", *notes),
        parted=("hand", "fingers"),
        data=tuple(data),
    )


def _summary(group: pd.DataFrame) -> dict[str, Any]:
    """Return what the trials of one planner say."""
    found = c.numbers(group, "local.q3").notna()
    summary: dict[str, Any] = {"objects": int(group[c.OBJECT].nunique()), "trials": len(group)}
    summary |= _interval("found", wilson_interval(int(found.sum()), len(group)))
    if c.SUCCESS in group:
        asked = c.numbers(group, c.SUCCESS).notna()
        held = c.numbers(group[asked], c.SUCCESS)
        summary |= _interval("held", wilson_interval(int(held.sum()), int(asked.sum())))
    objects = group[c.OBJECT].astype(str).tolist()
    for key, column in _MEANS.items():
        values = _numbers(group, column)
        summary |= _interval(key, bootstrap_mean(values, objects))
    for key, column in _MEDIANS.items():
        values = _numbers(group, column)
        known = values[np.isfinite(values)]
        summary[key] = float(np.median(known)) if len(known) else None
    return summary


def _numbers(group: pd.DataFrame, column: str) -> FloatArray:
    if column not in group:
        return np.full(len(group), np.nan)
    return c.numbers(group, column).to_numpy(dtype=np.float64)


def _interval(name: str, found: Interval) -> dict[str, float | None]:
    ends = {name: found.value, f"{name}.low": found.low, f"{name}.high": found.high}
    return {key: None if math.isnan(value) else value for key, value in ends.items()}


def _descending(row: Mapping[str, Any], *keys: str) -> tuple[float, ...]:
    return tuple(-row[key] if row.get(key) is not None else math.inf for key in keys)


def _any(rows: Sequence[Row], key: str) -> bool:
    return any(row.get(key) is not None for row in rows)


def _hand_columns(rows: Sequence[Row]) -> tuple[Column, ...]:
    """Return the columns of hand and fingers, as far as rows differ in them."""
    heads = (Column("hand", "hand"), Column("fingers", "fingers", format="d"))
    return tuple(head for head in heads if len({row[head.key] for row in rows}) > 1)


def _rate_column() -> Column:
    return Column("held", "held", format=".2f", interval=("held.low", "held.high"), best="largest")


def _mean_column(
    key: str, head: str, how: str, unit: str = "", *, best: Any = "largest", narrow: bool = True
) -> Column:
    return Column(key, head, unit, how, interval=(f"{key}.low", f"{key}.high"), best=best, narrow=narrow)
