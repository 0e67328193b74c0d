"""Tables as Markdown."""

from collections.abc import Sequence

from graspbench.report.tables.model import Table

_SPECIAL = str.maketrans({c: f"\\{c}" for c in "\\`*_{}[]<>#|&~"} | {"\n": " ", "\r": " "})


def to_markdown(table: Table) -> str:
    """Return a table with its caption as a heading above and its notes below."""
    best = table.best_cells()
    parts = [f"### {escape_markdown(table.caption)}", ""] if table.caption else []
    if table.rows:
        heads = [f"{column.group} {column.heading()}".strip() for column in table.columns]
        parts.append(_line([escape_markdown(head) for head in heads]))
        parts.append("|" + "|".join("--:" if column.right else "---" for column in table.columns) + "|")
        for i, row in enumerate(table.rows):
            cells = [(column.key, escape_markdown(column.cell(row))) for column in table.columns]
            parts.append(_line([f"**{text}**" if (i, key) in best else text for key, text in cells]))
    else:
        parts.append("Nothing to show.")
    for note in table.notes:
        parts += ["", escape_markdown(note)]
    return "\n".join(parts) + "\n"


def escape_markdown(text: str) -> str:
    """Return text in which nothing is markup, HTML included."""
    return text.translate(_SPECIAL)


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
