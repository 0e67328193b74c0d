"""Trials summarised by groups of one's own choice, with success rates, as tables."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from graspbench.report.statistics import STATISTICS, aggregate, spearman, wilson_interval
from graspbench.report.tables import latex_escape

DEFAULT_VALUES = ("ratio.q1", "ratio.q2", "ratio.q3", "local.time_s")
_QUALITIES = ("local.q1", "local.q2", "local.q3", "ratio.q1", "ratio.q2", "ratio.q3")
_UNITS = {
    "_s": "s",
    "_ms": "ms",
    "_m": "m",
    "_mm": "mm",
    "_deg": "deg",
    "_n": "N",
    "_kg": "kg",
    "_rad": "rad",
}
_SMALLER_IS_BETTER = (
    "time",
    "error",
    "slip",
    "drift",
    "turn",
    "displacement",
    "mesh_",
    "seconds",
    "iterations",
)


def group_table(
    trials: pd.DataFrame, group: Sequence[str], statistic: Sequence[str], values: Sequence[str] = ()
) -> pd.DataFrame:
    """Summarise trials by group: chosen statistics of values, and the success rate with Wilson's interval.

    Args:
        trials: One row a trial.
        group: Columns that make a group; "object" stands for "object.name", and so on.
        statistic: Any of `graspbench.report.statistics.STATISTICS`.
        values: Columns to summarise; by default ratios and planning time, as far as they are there.

    Raises:
        ConfigurationError: A column or a statistic is unknown.
    """
    chosen = list(values) or [name for name in DEFAULT_VALUES if name in trials]
    table = aggregate(trials, group, chosen, statistic)
    keys = list(table.columns[: len(group)])
    succeeded = trials["success"].fillna(False).astype(bool) if "success" in trials else None
    if succeeded is not None:
        counts = succeeded.groupby([trials[key] for key in keys], dropna=False, sort=True).sum()
        rates = [wilson_interval(int(good), int(n)) for good, n in zip(counts, table["trials"], strict=True)]
        table["success.rate"] = [rate.value for rate in rates]
        table["success.low"] = [rate.low for rate in rates]
        table["success.high"] = [rate.high for rate in rates]
    return table


def correlation_table(trials: pd.DataFrame) -> pd.DataFrame:
    """Return Spearman's rank correlation of every planned quality with what physics made of it.

    Returns:
        Columns quality, outcome, rho, low, high, trials; pairs of which nothing can be said are left out.
    """
    outcomes = [
        name
        for name in trials.columns
        if name == "success"
        or (
            str(name).startswith("execution.")
            and str(name).endswith(("slip_m", "drift_m", "turn_deg", "push_weight"))
        )
    ]
    records = []
    for quality in (name for name in _QUALITIES if name in trials):
        for outcome in outcomes:
            found = spearman(_numbers(trials[quality]), _numbers(trials[outcome]))
            if not math.isnan(found.value):
                records.append(
                    {
                        "quality": quality,
                        "outcome": str(outcome),
                        "rho": found.value,
                        "low": found.low,
                        "high": found.high,
                        "trials": found.count,
                    }
                )
    return pd.DataFrame(records, columns=["quality", "outcome", "rho", "low", "high", "trials"])


def frame_markdown(table: pd.DataFrame, title: str, notes: Sequence[str] = ()) -> str:
    """Return any table as Markdown, numbers with three significant digits, the best of a column bold."""
    best = _best(table)
    head = "| " + " | ".join(heading(name).replace("_", r"\_") for name in table.columns) + " |"
    rule = "|" + "".join("--:|" if _numeric(table[name]) else "---|" for name in table.columns)
    lines = [f"### {title}", "", head, rule]
    for i, row in enumerate(table.itertuples(index=False)):
        cells = []
        for name, value in zip(table.columns, row, strict=True):
            text = cell_text(value).replace("_", r"\_").replace("|", r"\|")
            cells.append(f"**{text}**" if (i, name) in best else text)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", *notes, ""])


def frame_latex(table: pd.DataFrame, title: str, label: str, notes: Sequence[str] = ()) -> str:
    """Return any table as LaTeX for the package booktabs: units in the heads, the best of a column bold."""
    best = _best(table)
    kinds = "".join("r" if _numeric(table[name]) else "l" for name in table.columns)
    body = []
    for i, row in enumerate(table.itertuples(index=False)):
        cells = []
        for name, value in zip(table.columns, row, strict=True):
            text = latex_escape(cell_text(value, "--"))
            cells.append(rf"\textbf{{{text}}}" if (i, name) in best else text)
        body.append(" & ".join(cells) + r" \\")
    return "\n".join(
        [
            "% Needs \\usepackage{booktabs}.",
            r"\begin{table}[t]",
            r"  \centering\scriptsize\setlength{\tabcolsep}{3pt}",
            rf"  \caption{{{latex_escape(' '.join([title + '.', *notes]))}}}",
            rf"  \label{{{label}}}",
            rf"  \begin{{tabular}}{{@{{}}{kinds}@{{}}}}",
            r"    \toprule",
            "    " + " & ".join(latex_escape(heading(name)) for name in table.columns) + r" \\",
            r"    \midrule",
            *(f"    {line}" for line in body),
            r"    \bottomrule",
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def heading(name: object) -> str:
    """Return a column's heading with its unit, which the column's name ends with."""
    whole = str(name)
    column, _, last = whole.rpartition(".")
    if last not in STATISTICS:
        column = whole
    for suffix, unit in _UNITS.items():
        if column.endswith(suffix):
            return f"{column.removesuffix(suffix)}{whole[len(column) :]} [{unit}]"
    return whole


def cell_text(value: Any, missing: str = "-") -> str:
    """Return a value for people: three significant digits, booleans in words."""
    if value is None or (isinstance(value, float) and math.isnan(value)) or value is pd.NA:
        return missing
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, float | np.floating):
        return f"{value:.3g}"
    return str(value)


def _best(table: pd.DataFrame) -> set[tuple[int, object]]:
    """Return the cells of means and success rates that are best in their column."""
    best: set[tuple[int, object]] = set()
    for name in table.columns:
        text = str(name)
        if len(table) < 2 or not text.endswith((".mean", ".median", ".rate")):
            continue
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=np.float64)
        if np.isnan(values).all():
            continue
        smaller = any(word in text for word in _SMALLER_IS_BETTER)
        top = np.nanmin(values) if smaller else np.nanmax(values)
        best |= {(int(i), name) for i in np.flatnonzero(values == top)}
    return best


def _numeric(values: pd.Series) -> bool:
    return bool(pd.api.types.is_numeric_dtype(values)) and values.dtype != bool


def _numbers(values: pd.Series) -> Any:
    return pd.to_numeric(values, errors="coerce").astype(float).to_numpy()
