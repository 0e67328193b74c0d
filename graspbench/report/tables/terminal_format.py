"""Tables for a terminal."""

from collections.abc import Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from graspbench.report.tables.model import Column, Table, panels

_UNLIMITED = 10_000


def to_terminal(table: Table, width: int | None = None) -> RenderableType:
    """Return a table that Rich prints, its notes below it; nothing in it is read as markup.

    Args:
        table: The table.
        width: Letters in a line; a table that is wider is cut between columns. None: there is no limit.
    """
    if not table.rows:
        return Text(f"{table.caption}: nothing to show" if table.caption else "nothing to show")
    columns = [column for column in table.columns if column.narrow]

    def fits(chosen: Sequence[Column]) -> bool:
        return width is None or table_width(_drawn(table, chosen)) <= width

    sides = [_drawn(table, side) for side in panels(columns, fits)]
    if table.caption:
        sides[0].title = _plain(table.caption, "italic")
    return Group(*sides, *(Text(f"note: {note}") for note in table.notes))


def table_width(drawn: RenderableType) -> int:
    """Return the letters that a table needs in a line."""
    console = Console(width=_UNLIMITED)
    return console.measure(drawn).maximum


def _drawn(table: Table, columns: Sequence[Column]) -> RichTable:
    best = table.best_cells()
    drawn = RichTable(title_justify="left")
    for column in columns:
        head = "\n".join(part for part in (column.group, column.heading()) if part)
        drawn.add_column(_plain(head), justify="right" if column.right else "left", overflow="fold")
    for i, row in enumerate(table.rows):
        if table.begins_part(i):
            drawn.add_section()
        drawn.add_row(
            *(_plain(column.cell(row), "bold" if (i, column.key) in best else "") for column in columns)
        )
    return drawn


def _plain(text: str, style: str = "") -> Text:
    return Text(text, style)
