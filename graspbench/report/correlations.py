"""What planned quality foretells of what physics makes of a grasp."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from graspbench.report import columns as c
from graspbench.report.heads import head_of
from graspbench.report.notes import success_notes, trial_notes
from graspbench.report.statistics import corrected, spearman
from graspbench.report.tables import Column, Table

SIGNIFICANCE = 0.05


def correlation_table(trials: pd.DataFrame, outcomes: Sequence[str] = ()) -> Table:
    """Return Spearman's rank correlation of every planned quality with what physics made of it.

    People see a row an outcome and a column a quality, with an asterisk where the p value is below
    `SIGNIFICANCE` after Benjamini and Hochberg's correction for the number of pairs. The data have a row a
    pair, with intervals and p values; pairs without an estimate are left out.

    Trials that executed another grasp, strengthened or explored, are left out: what came of it says nothing
    of the planned one.

    Args:
        trials: One row a trial.
        outcomes: Columns of outcomes; by default success, and slip, drift and turn of every phase.
    """
    all_trials, trials = trials, _as_planned(trials)
    left_out = len(all_trials) - len(trials)
    records: list[dict[str, Any]] = []
    for quality in (name for name in c.QUALITIES if name in trials):
        for outcome in outcomes or c.physics_outcomes(trials):
            found = spearman(c.numbers(trials, quality).to_numpy(), c.numbers(trials, outcome).to_numpy())
            if not math.isnan(found.value):
                records.append(
                    {
                        "quality": quality, "outcome": outcome, "rho": found.value, "low": found.low,
                        "high": found.high, "p": found.p, "trials": found.count,
                    }
                )  # fmt: skip
    p = corrected(np.array([record["p"] for record in records]))
    data = tuple(
        {**record, "p_corrected": float(value), "significant": bool(value < SIGNIFICANCE)}
        for record, value in zip(records, p, strict=True)
    )
    notes = (
        f"* p < {SIGNIFICANCE:g} after Benjamini and Hochberg's correction for {len(data)} pairs; intervals "
        f"and p values are in the data. n = {_span([int(row['trials']) for row in data])} trials a pair."
        if data
        else "Of no pair anything can be said.",
        *(
            [f"{left_out} trials are left out that executed a strengthened or explored grasp."]
            if left_out
            else []
        ),
        *success_notes(trials),
        *trial_notes(trials),
    )
    qualities = list(dict.fromkeys(row["quality"] for row in data))
    return Table(
        "correlations",
        "Quality against physics: Spearman's rank correlation",
        (
            Column("outcome_head", "outcome"),
            *(
                Column(quality, *head_of(quality), format=".2f", mark=f"{quality}.significant")
                for quality in qualities
            ),
        ),
        _arranged(data),
        notes,
        data=data,
    )


def _as_planned(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the trials that executed the planner's own grasp."""
    for column in (c.STRENGTHENED, c.EXPLORED):
        if column in trials:
            trials = trials[trials[column].isna()]
    return trials


def _arranged(data: Sequence[dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    """Return a row an outcome, with each quality's rho."""
    rows: dict[str, dict[str, Any]] = {}
    for pair in data:
        outcome, quality = pair["outcome"], pair["quality"]
        row = rows.setdefault(outcome, {"outcome": outcome, "outcome_head": head_of(outcome)[0]})
        row |= {quality: pair["rho"], f"{quality}.significant": pair["significant"]}
    return tuple(rows.values())


def _span(counts: Sequence[int]) -> str:
    return f"{min(counts)}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
