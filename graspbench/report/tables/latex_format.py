"""Tables as LaTeX floats that fit a column or the width of a two-column page; booktabs is all they need."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from graspbench.report.tables.latex_text import escape_latex, latex_prose
from graspbench.report.tables.model import Column, Table, panels

__all__ = ["COLUMN_WIDTH_PT", "PAGE_WIDTH_PT", "escape_latex", "to_latex"]

# Of LaTeX's own two-column article; those of journals are wider.
COLUMN_WIDTH_PT = 229.0
PAGE_WIDTH_PT = 469.0

MAX_ROWS = 44
"""Rows that a page holds beside a caption."""

_MAX_TEXT_PT = 130.0  # longer text is broken into lines

# Of Computer Modern, against a digit.
_SLIM, _BROAD, _BOLD = frozenset(" ijlt.,:;'[]()|!/f"), frozenset("mwMW@%±_<>"), 1.15


@dataclass(frozen=True)
class _Layout:
    """How a table is set.

    Attributes:
        environment: The float.
        width_pt: What it may take.
        size: The command for the letters' size.
        digit_pt: The width of a digit.
        separation_pt: Half the space between columns.
    """

    environment: str
    width_pt: float
    size: str
    digit_pt: float
    separation_pt: float = 3.0


_LAYOUTS = (
    _Layout("table", COLUMN_WIDTH_PT, r"\footnotesize", 4.25),
    _Layout("table", COLUMN_WIDTH_PT, r"\scriptsize", 3.98),
    _Layout("table*", PAGE_WIDTH_PT, r"\footnotesize", 4.25),
    _Layout("table*", PAGE_WIDTH_PT, r"\scriptsize", 3.98),
    _Layout("table*", PAGE_WIDTH_PT, r"\scriptsize", 3.98, separation_pt=1.5),
)


def to_latex(table: Table) -> str:
    """Return a table as one float, or as several where it is wider or taller than a page.

    A table that fits a column becomes ``table``, one that fits a page ``table*``. What is too wide is cut
    between columns, and the columns of text that name a row are repeated; what is too tall is cut between
    rows.
    """
    columns = [column for column in table.columns if column.narrow]
    layout, sides = _fitted(table, columns)
    chunks = _chunks(table)
    parts = [(panel, chunk) for chunk in chunks for panel in sides]
    floats = []
    for number, (panel, chunk) in enumerate(parts, 1):
        of = f" (part {number} of {len(parts)})" if len(parts) > 1 else ""
        floats.append(_float(table, panel, chunk, layout, of, notes=number == 1))
    width = "column" if layout.environment == "table" else "page"
    head = f"% Needs \\usepackage{{booktabs}}; fits a {width} of {layout.width_pt:.0f} pt.\n"
    return head + "\n".join(floats)


def _fitted(table: Table, columns: list[Column]) -> tuple[_Layout, list[list[Column]]]:
    """Return the smallest layout that holds all columns; the largest, and panels, where none does."""
    for layout in _LAYOUTS:
        if _width_pt(table, columns, layout) <= layout.width_pt:
            return layout, [columns]
    layout = _LAYOUTS[-1]
    return layout, panels(columns, lambda chosen: _width_pt(table, chosen, layout) <= layout.width_pt)


def _chunks(table: Table) -> list[range]:
    """Return the rows of each page, cut where a part begins if that is near."""
    total, chunks, start = len(table.rows), [], 0
    while start < total:
        end = min(start + MAX_ROWS, total)
        if end < total:
            breaks = [i for i in range(start + MAX_ROWS // 2, end + 1) if table.begins_part(i)]
            end = breaks[-1] if breaks else end
        chunks.append(range(start, end))
        start = end
    return chunks or [range(0)]


def _width_pt(table: Table, columns: Sequence[Column], layout: _Layout) -> float:
    cells = sum(_column_width_pt(table, column, layout) for column in columns)
    return cells + 2 * layout.separation_pt * (len(columns) - 1)


def _column_width_pt(table: Table, column: Column, layout: _Layout) -> float:
    cells = max((_digits(column.cell(row)) for row in table.rows), default=0.0)
    digits = max(cells * (_BOLD if column.best else 1.0), *map(_digits, _head_lines(column, cells)))
    return min(layout.digit_pt * digits, _MAX_TEXT_PT)


def _digits(text: str) -> float:
    """Return the width of a text in digits of Computer Modern."""
    return sum(0.64 if c in _SLIM else 1.55 if c in _BROAD or c.isupper() else 1.01 for c in text)


def _head_lines(column: Column, cells: float) -> list[str]:
    """Return a heading's lines, none wider than the cells or its widest word."""
    words = re.split(r"\s+(?!/)", column.heading())  # no line begins with a slash
    widest = max([cells, *map(_digits, words)])
    lines = [""]
    for word in words:
        joined = f"{lines[-1]} {word}".strip()
        lines = [*lines[:-1], joined] if _digits(joined) <= widest else [*lines, word]
    return lines


def _float(
    table: Table, columns: Sequence[Column], rows: range, layout: _Layout, of: str, *, notes: bool
) -> str:
    best = table.best_cells()
    kinds = "".join("r" if column.right else "l" for column in columns)
    body = []
    for i in rows:
        if table.begins_part(i) and i != rows.start:
            body.append(r"\addlinespace")
        cells = [_cell(table, column, i, (i, column.key) in best, layout) for column in columns]
        body.append(" & ".join(cells) + r" \\")
    sentences = [f"{table.caption}{of}.", *(table.notes if notes else ())]
    label = f"tab:{table.name}" if notes else f"tab:{table.name}-{rows.start}-{columns[-1].key}"
    return "\n".join(
        [
            rf"\begin{{{layout.environment}}}[t]",
            r"  \setlength{\abovecaptionskip}{0pt}\setlength{\belowcaptionskip}{4pt}",
            rf"  \centering{layout.size}\setlength{{\tabcolsep}}{{{layout.separation_pt:g}pt}}",
            rf"  \caption{{{latex_prose(' '.join(sentences))}}}",
            rf"  \label{{{re.sub(r'[^A-Za-z0-9:.-]', '-', label)}}}",
            rf"  \begin{{tabular}}{{@{{}}{kinds}@{{}}}}",
            r"    \toprule",
            *(f"    {line}" for line in _heads(table, columns)),
            r"    \midrule",
            *(f"    {line}" for line in body),
            r"    \bottomrule",
            r"  \end{tabular}",
            rf"\end{{{layout.environment}}}",
            "",
        ]
    )


def _heads(table: Table, columns: Sequence[Column]) -> list[str]:
    """Return the lines of headings, those above first."""
    lines = []
    if any(column.group for column in columns):
        cells, rules, at = [], [], 1
        for group, span in table.groups(columns):
            cells.append(
                rf"\multicolumn{{{span}}}{{c}}{{{latex_prose(group)}}}" if group else "&" * (span - 1)
            )
            if group:
                rules.append(rf"\cmidrule(lr){{{at}-{at + span - 1}}}")
            at += span
        lines = [" & ".join(cells) + r" \\", "".join(rules)]
    heads = []
    for column in columns:
        cells_digits = max((_digits(column.cell(row)) for row in table.rows), default=0.0)
        broken = r"\\".join(latex_prose(line) for line in _head_lines(column, cells_digits))
        side = "r" if column.right else "l"
        heads.append(rf"\shortstack[{side}]{{{broken}}}" if r"\\" in broken else broken)
    return [*lines, " & ".join(heads) + r" \\"]


def _cell(table: Table, column: Column, i: int, bold: bool, layout: _Layout) -> str:
    text = column.cell(table.rows[i])
    written = "--" if text == "-" else latex_prose(text)
    if bold:
        written = rf"\textbf{{{written}}}"
    if layout.digit_pt * _digits(text) <= _MAX_TEXT_PT:
        return written
    return rf"\parbox[t]{{{math.floor(_MAX_TEXT_PT)}pt}}{{\raggedright {written}\strut}}"
