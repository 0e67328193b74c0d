"""Trials summarised by groups of one's own choice, with success rates."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from graspbench.report import columns as c
from graspbench.report.heads import head_of, smaller_is_better
from graspbench.report.notes import status_notes, success_notes, trial_notes
from graspbench.report.statistics import aggregate, find_column, wilson_interval
from graspbench.report.tables import SIGNIFICANT, Column, Table

_SPREADS = {"ci": "95 % interval of the mean", "std": "standard deviation"}


def group_table(
    trials: pd.DataFrame, group: Sequence[str], statistic: Sequence[str], values: Sequence[str] = ()
) -> Table:
    """Summarise trials by group: chosen statistics of values, and the success rate with Wilson's interval.

    Means and success rates are bold where they are the best of rows of one object: what is compared is how a
    grasp was planned, not for what.

    Args:
        trials: One row a trial.
        group: Columns that make a group; "object" stands for "object.name", and so on.
        statistic: Any of `graspbench.report.statistics.STATISTICS`.
        values: Columns to summarise; by default ratios and planning time, as far as they are there.

    Raises:
        ConfigurationError: A column or a statistic is unknown.
    """
    trials, everything = trials[trials[c.STATUS] != c.UNREADABLE], trials
    chosen = [find_column(trials, name) for name in values] or [
        name for name in c.SUMMARISED if name in trials and c.numbers(trials, name).notna().any()
    ]
    keys = [find_column(trials, name) for name in group]
    grouped = aggregate(trials, keys, chosen, statistic)
    rates = c.SUCCESS in trials and bool(c.numbers(trials, c.SUCCESS).notna().any())
    if rates:
        _add_rates(grouped, trials, keys)
    same = tuple(key for key in keys if c.is_problem(key))
    return Table(
        "groups",
        f"By {', '.join(head_of(key)[0] for key in keys)}",
        (*_key_columns(grouped, keys), *_value_columns(chosen, statistic), *_rate_columns(grouped, rates)),
        tuple(_plain(record) for record in grouped.to_dict("records")),
        (
            *_statistic_notes(statistic, rates),
            *status_notes(everything),
            *success_notes(trials),
            *trial_notes(trials, keys),
        ),
        compared=same if len(same) < len(keys) else None,
        parted=tuple(keys[:1]) if len(keys) > 1 else (),
    )


_RATE = (
    Column("success.rate", "success", format=".2f", interval=("success.low", "success.high"), best="largest"),
    Column("success.trials", "executed", format="d"),
)


def _rate_columns(grouped: pd.DataFrame, rates: bool) -> list[Column]:
    """Return the columns of the success rate: its own number of trials where that differs."""
    if not rates:
        return []
    same = (grouped["success.trials"] == grouped["trials"]).all()
    return list(_RATE[:1] if same else _RATE)


def _add_rates(grouped: pd.DataFrame, trials: pd.DataFrame, keys: Sequence[str]) -> None:
    """Add each group's success rate over the trials of which it is known."""
    known = c.numbers(trials, c.SUCCESS).groupby([trials[key] for key in keys], dropna=False, sort=True)
    pairs = zip(known.sum(), known.count(), strict=True)
    rates = [wilson_interval(int(good), int(n)) for good, n in pairs]
    grouped["success.rate"] = [rate.value for rate in rates]
    grouped["success.low"] = [rate.low if rate.count else None for rate in rates]
    grouped["success.high"] = [rate.high if rate.count else None for rate in rates]
    grouped["success.trials"] = [rate.count for rate in rates]


def _key_columns(grouped: pd.DataFrame, keys: Sequence[str]) -> list[Column]:
    numeric = {key: pd.api.types.is_numeric_dtype(grouped[key]) for key in keys}
    columns = [Column(key, *head_of(key), format="g" if numeric[key] else "") for key in keys]
    return [*columns, Column("trials", "n", format="d")]


def _value_columns(values: Sequence[str], statistic: Sequence[str]) -> list[Column]:
    """Return the columns of the statistics: a spread stands behind the mean, where there is one."""
    spread = next((name for name in statistic if name in _SPREADS), None) if "mean" in statistic else None
    columns = []
    for value in values:
        head, unit = head_of(value)
        for name in statistic:
            if name == spread:
                continue
            best = name in ("mean", "median")
            columns.append(
                Column(
                    f"{value}.{name}",
                    head if name == "mean" else f"{head}, {name}",
                    "" if name == "count" else unit,
                    SIGNIFICANT if name != "count" else "g",
                    spread=f"{value}.{spread}" if name == "mean" and spread else None,
                    best=("smallest" if smaller_is_better(value) else "largest") if best else "",
                )
            )
    return columns


def _statistic_notes(statistic: Sequence[str], rates: bool) -> list[str]:
    spread = next((name for name in statistic if name in _SPREADS), None) if "mean" in statistic else None
    notes = [f"Mean ± {_SPREADS[spread]}."] if spread else []
    if rates:
        notes.append("Success: rate with Wilson's 95 % interval.")
    return notes


def _plain(record: dict[Any, Any]) -> dict[str, Any]:
    return {str(key): None if pd.isna(value) else value for key, value in record.items()}
