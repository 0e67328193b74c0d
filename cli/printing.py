"""How results look on a terminal: stdout carries results, stderr progress."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from graspbench.experiment import to_json

out = Console(soft_wrap=True)
err = Console(stderr=True, soft_wrap=True)


def print_json(document: Any) -> None:
    """Print one JSON document on stdout."""
    print(to_json(document), end="")


def print_rows(
    rows: Sequence[Mapping[str, Any]], title: str | None = None, columns: Sequence[str] | None = None
) -> None:
    """Print rows of the same kind as a table; the columns are those of the first row."""
    if not rows:
        out.print(f"{title}: nothing to show" if title else "nothing to show")
        return
    names = list(columns or rows[0])
    table = Table(title=title, title_justify="left")
    for name in names:
        numeric = all(isinstance(row.get(name), int | float | None) for row in rows)
        table.add_column(name, justify="right" if numeric else "left", overflow="fold")
    for row in rows:
        table.add_row(*(cell(row.get(name)) for name in names))
    out.print(table)


def cell(value: Any) -> str:
    """Format one value for people."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(cell(item) for item in value)
    return str(value)
