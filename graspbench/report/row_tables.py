"""Small tables of plain rows, as CSV, Markdown and LaTeX."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from graspbench.report.tables import latex_escape

Rows = Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class Column:
    """A column that people read.

    Attributes:
        key: Where its values are in a row.
        head: Its heading, with the unit.
        latex: The same for LaTeX.
        digits: Digits after the point; None for text and whole numbers.
    """

    key: str
    head: str
    latex: str
    digits: int | None = None

    def cell(self, row: Mapping[str, Any]) -> str:
        """Return the row's value as text, a dash where there is none."""
        value = row.get(self.key)
        if value is None:
            return "-"
        return str(value) if self.digits is None else f"{value:.{self.digits}f}"


def rows_csv(rows: Rows) -> str:
    """Return all values of the rows with full precision; lists and mappings are left out."""
    plain = [{key: value for key, value in row.items() if not isinstance(value, list | dict)} for row in rows]
    return pd.DataFrame(plain).to_csv(index=False, lineterminator="\n")


def rows_markdown(rows: Rows, columns: Sequence[Column], title: str, notes: Sequence[str]) -> str:
    """Return a Markdown table with a heading above and notes below."""
    lines = [f"### {title}", "", _markdown_row([column.head for column in columns])]
    lines.append("|" + "|".join("---" if column.digits is None else "--:" for column in columns) + "|")
    lines += [_markdown_row([column.cell(row) for column in columns]) for row in rows]
    return "\n".join([*lines, "", *(note.replace("_", r"\_") for note in notes), ""])


def rows_latex(rows: Rows, columns: Sequence[Column], title: str, notes: Sequence[str], label: str) -> str:
    """Return a LaTeX table environment; it needs the package booktabs only."""
    kinds = "".join("l" if column.digits is None else "r" for column in columns)
    body = [" & ".join(latex_escape(column.cell(row)) for column in columns) + r" \\" for row in rows]
    return "\n".join(
        [
            "% Needs \\usepackage{booktabs}.",
            r"\begin{table}[t]",
            r"  \centering\footnotesize",
            rf"  \caption{{{latex_escape(title)}. {latex_escape(' '.join(notes))}}}",
            rf"  \label{{{label}}}",
            rf"  \begin{{tabular}}{{@{{}}{kinds}@{{}}}}",
            r"    \toprule",
            "    " + " & ".join(column.latex for column in columns) + r" \\",
            r"    \midrule",
            *(f"    {line}" for line in body),
            r"    \bottomrule",
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def row_tables(
    rows: Rows, columns: Sequence[Column], title: str, notes: Sequence[str], label: str
) -> dict[str, str]:
    """Return the table as file contents by file name.

    Args:
        rows: One mapping a row; the CSV holds all their values.
        columns: What the other two formats show.
        title: Heading and caption.
        notes: Sentences below it.
        label: LaTeX label.
    """
    return {
        "table.csv": rows_csv(rows),
        "table.md": rows_markdown(rows, columns, title, notes),
        "table.tex": rows_latex(rows, columns, title, notes, label),
    }


def _markdown_row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("_", r"\_").replace("|", r"\|") for cell in cells) + " |"
