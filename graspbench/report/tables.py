"""Thesis table 3.1 from one's own trials, as CSV, Markdown and LaTeX."""

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from graspbench.errors import ConfigurationError
from graspbench.report.comparison import Row, comparison_table

_SUFFIX = {"csv": "csv", "markdown": "md", "latex": "tex"}
_TITLE = "Local against global grasps"
_LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "<": r"\textless{}", ">": r"\textgreater{}",
}  # fmt: skip
_MARKDOWN = str.maketrans({c: f"\\{c}" for c in "\\`*_{}[]<>#|"})


def write_table(trials: pd.DataFrame, formats: Sequence[str], output_dir: Path) -> tuple[Path, ...]:
    """Write the comparison table, one file a format.

    Args:
        trials: One row a trial, dotted column names as in ``trials.csv``.
        formats: Any of "csv", "markdown", "latex".
        output_dir: Folder of the files ``table.csv``, ``table.md``, ``table.tex``; made if need be.

    Returns:
        The files, in the order of the formats.

    Raises:
        ConfigurationError: A format is unknown.
        LogError: There are no trials.
    """
    unknown = [name for name in formats if name not in _SUFFIX]
    if unknown:
        raise ConfigurationError(
            f"unknown table format '{unknown[0]}'", remedy=f"choose from {', '.join(_SUFFIX)}"
        )
    rows = comparison_table(trials)
    writers = {"csv": table_csv, "markdown": table_markdown, "latex": table_latex}
    output_dir.mkdir(parents=True, exist_ok=True)
    paths = []
    for name in formats:
        path = output_dir / f"table.{_SUFFIX[name]}"
        path.write_text(writers[name](rows), encoding="utf-8")
        paths.append(path)
    return tuple(paths)


def table_csv(rows: Sequence[Row]) -> str:
    """Return the table with full precision, one column a value."""
    records = []
    for row in rows:
        record: dict[str, object] = {
            "index": row.index, "k_cm": row.k_cm, "object": row.object, "hand": row.hand,
            "fingers": row.fingers, "trials": row.trials, "failed": row.failed,
        }  # fmt: skip
        for i, cell in enumerate(row.cells, start=1):
            record[f"q{i}_local"], record[f"q{i}_global"] = cell.local, cell.best
            record[f"q{i}_ratio"], record[f"q{i}_ratio_thesis"] = cell.ratio, cell.thesis
        records.append(record)
    return pd.DataFrame(records).to_csv(index=False, lineterminator="\n")


def table_markdown(rows: Sequence[Row]) -> str:
    """Return the table for a README: values local / global, ratio, the thesis' ratio behind it."""
    lines = [f"### {_TITLE}", ""]
    head = ["k_cm", "object", "fingers", "trials"]
    for i in (1, 2, 3):
        head += [f"Q{i} local / global", "ratio (thesis)"]
    lines.append("| " + " | ".join(head) + " |")
    lines.append("|" + "---|---|" + "--:|" * (len(head) - 2))
    best = _best_ratios(rows)
    for row in rows:
        name = row.object.translate(_MARKDOWN)
        cells = [_gain(row), f"{name}", str(row.fingers), _count(row)]
        for i, cell in enumerate(row.cells):
            ratio = _number(cell.ratio, 2)
            if _is_best(cell.ratio, best[i]):
                ratio = f"**{ratio}**"
            if not math.isnan(cell.thesis):
                ratio += f" ({cell.thesis:.2f})"
            cells += [f"{_number(cell.local)} / {_number(cell.best)}", ratio]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", *(note.replace("_", r"\_") for note in _notes(rows)), ""])


def table_latex(rows: Sequence[Row]) -> str:
    """Return a table environment for a paper; it needs the package booktabs only."""
    best = _best_ratios(rows)
    thesis = any(not math.isnan(cell.thesis) for row in rows for cell in row.cells)
    per = 4 if thesis else 3
    columns = "@{}ll" + ("r" * per) * 3 + "@{}"
    top = " & ".join(rf"\multicolumn{{{per}}}{{c}}{{$Q_{i}$ [--]}}" for i in (1, 2, 3))
    rules = "".join(rf"\cmidrule(lr){{{3 + per * k}-{2 + per * (k + 1)}}}" for k in range(3))
    names = " & ".join(["local & glob. & ratio" + (" & thesis" if thesis else "")] * 3)
    body = []
    for i, row in enumerate(rows):
        if i and (row.index, row.k_cm) != (rows[i - 1].index, rows[i - 1].k_cm):
            body.append(r"\addlinespace")
        cells = [_gain(row, latex=True), latex_escape(f"{row.object} ({row.fingers})")]
        for k, cell in enumerate(row.cells):
            ratio = _number(cell.ratio, 2, "--")
            if _is_best(cell.ratio, best[k]):
                ratio = rf"\textbf{{{ratio}}}"
            cells += [_number(cell.local, 3, "--"), _number(cell.best, 3, "--"), ratio]
            if thesis:
                cells.append(_number(cell.thesis, 2, "--"))
        body.append(" & ".join(cells) + r" \\")
    notes = latex_escape(" ".join(_notes(rows))).replace(r"k\_cm", r"$k_{cm}$")
    return "\n".join(
        [
            "% Needs \\usepackage{booktabs}.",
            r"\begin{table}[t]",
            r"  \centering",
            rf"  \caption{{{_TITLE}. {notes}}}",
            r"  \label{tab:local-global}",
            r"  \setlength{\tabcolsep}{1.7pt}" + (r"\scriptsize" if thesis else r"\footnotesize"),
            rf"  \begin{{tabular}}{{{columns}}}",
            r"    \toprule",
            rf"    & & {top} \\",
            rf"    {rules}",
            rf"    $k_{{cm}}$ & object (fingers) & {names} \\",
            r"    \midrule",
            *(f"    {line}" for line in body),
            r"    \bottomrule",
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def latex_escape(text: str) -> str:
    """Return text in which LaTeX's special characters stand for themselves."""
    return "".join(_LATEX.get(character, character) for character in text)


def _notes(rows: Sequence[Row]) -> list[str]:
    counts = sorted({row.trials for row in rows})
    indices = ", ".join(sorted({row.index for row in rows}))
    hands = ", ".join(sorted({row.hand for row in rows}))
    span = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    notes = [
        f"Means over {span} trial(s) a row; index {indices}; hand {hands}.",
        "Best ratio of each measure bold.",
    ]
    if any(not math.isnan(cell.thesis) for row in rows for cell in row.cells):
        notes.append(
            "The thesis' ratios are from its table 3.1, which does not state its contact model: no values."
        )
    failed = sum(row.failed for row in rows)
    if failed:
        notes.append(f"{failed} trial(s) ended without a grasp and are not in the means.")
    return notes


def _best_ratios(rows: Sequence[Row]) -> list[float]:
    """Return the largest ratio of each measure, nan where there are not two to compare."""
    best = []
    for k in range(3):
        values = [row.cells[k].ratio for row in rows if not math.isnan(row.cells[k].ratio)]
        best.append(max(values) if len(values) > 1 else math.nan)
    return best


def _is_best(value: float, best: float) -> bool:
    return not math.isnan(best) and round(value, 2) == round(best, 2)


def _number(value: float, digits: int = 3, missing: str = "-") -> str:
    """Return a number that keeps three significant digits when it is small."""
    if math.isnan(value):
        return missing
    if digits == 3 and value != 0 and abs(value) < 0.01:
        return f"{value:.2g}" if abs(value) >= 1e-4 else f"{value:.1e}"
    return f"{value:.{digits}f}"


def _gain(row: Row, *, latex: bool = False) -> str:
    if row.k_cm is None:
        return latex_escape(row.index) if latex else row.index.translate(_MARKDOWN)
    return f"{row.k_cm:g}"


def _count(row: Row) -> str:
    return str(row.trials) if not row.failed else f"{row.trials} of {row.trials + row.failed}"
