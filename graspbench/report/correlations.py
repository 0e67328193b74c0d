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

_COLUMNS = (
    Column("quality_head", "planned quality"),
    Column("outcome_head", "outcome"),
    Column("rho", "rho", format=".2f", interval=("low", "high")),
    Column("p", "p", format=".2g"),
    Column("p_corrected", "p, corrected", format=".2g"),
    Column("trials", "n", format="d"),
)


def correlation_table(trials: pd.DataFrame, outcomes: Sequence[str] = ()) -> Table:
    """Return Spearman's rank correlation of every planned quality with what physics made of it.

    All pairs of which something can be said are in the rows, with p values corrected for their number by
    Benjamini and Hochberg's procedure; pairs without an estimate are left out.

    Args:
        trials: One row a trial.
        outcomes: Columns of outcomes; by default success, and slip, drift and turn of every phase.
    """
    records: list[dict[str, Any]] = []
    for quality in (name for name in c.QUALITIES if name in trials):
        for outcome in outcomes or c.physics_outcomes(trials):
            found = spearman(c.numbers(trials, quality).to_numpy(), c.numbers(trials, outcome).to_numpy())
            if not math.isnan(found.value):
                records.append(
                    {
                        "quality": quality, "outcome": outcome, "quality_head": head_of(quality)[0],
                        "outcome_head": head_of(outcome)[0], "rho": found.value, "low": found.low,
                        "high": found.high, "p": found.p, "trials": found.count,
                    }
                )  # fmt: skip
    p = corrected(np.array([record["p"] for record in records]))
    rows = tuple({**record, "p_corrected": float(value)} for record, value in zip(records, p, strict=True))
    sure = sum(row["p_corrected"] < SIGNIFICANCE for row in rows)
    return Table(
        "correlations",
        "Quality against physics: Spearman's rank correlation",
        _COLUMNS,
        rows,
        (
            f"95 % intervals; p corrected for {len(rows)} pairs by Benjamini and Hochberg, below "
            f"{SIGNIFICANCE:g} in {sure}.",
            *success_notes(trials),
            *trial_notes(trials),
        ),
        parted=("quality",),
    )
