"""What a table is, whatever format it is written in."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Row = Mapping[str, Any]
Rows = Sequence[Row]

SIGNIFICANT = "significant"
"""The format of a number with three significant digits, without an exponent where that is readable."""

MISSING = "-"
_DIGITS = 3
_READABLE = (1e-3, 1e5)  # beyond, an exponent is shorter


@dataclass(frozen=True)
class Column:
    """A column that people read.

    Attributes:
        key: Where its values are in a row.
        head: Its heading as a reader knows it, without unit.
        unit: The unit of its values; "" for none.
        format: How numbers are written: `SIGNIFICANT`, or a format specification such as ".2f"; "" for text
            and whole numbers.
        group: The heading above, which neighbouring columns share; "" for none.
        spread: The key of a half width or standard deviation that is shown behind a plus-minus sign.
        interval: The keys of the lower and the upper end that are shown in brackets.
        mark: The key of a truth that is shown as an asterisk behind the value.
        best: Which value of those that are compared is bold; "" for none.
        narrow: Whether it is shown where room is short, on a page and in a terminal.
    """

    key: str
    head: str
    unit: str = ""
    format: str = ""
    group: str = ""
    spread: str | None = None
    interval: tuple[str, str] | None = None
    mark: str | None = None
    best: Literal["", "largest", "smallest"] = ""
    narrow: bool = True

    @property
    def right(self) -> bool:
        """Whether its cells end at the right edge, as numbers do."""
        return self.format != ""

    def heading(self) -> str:
        """Return the heading with its unit."""
        return f"{self.head} [{self.unit}]".strip() if self.unit else self.head

    def cell(self, row: Row) -> str:
        """Return a row's value as people read it; a dash where there is none."""
        text = value_text(row.get(self.key), self.format)
        if text == MISSING:
            return text
        if self.spread is not None and known(row.get(self.spread)):
            text += f" ± {_like(row[self.spread], text, self.format)}"
        if self.interval is not None:
            ends = [row.get(key) for key in self.interval]
            if all(known(end) for end in ends):
                text += " [" + ", ".join(value_text(end, self.format) for end in ends) + "]"
        return f"{text}*" if self.mark is not None and row.get(self.mark) else text


@dataclass(frozen=True)
class Table:
    """A table: what it holds, and what a reader must be told about it.

    Attributes:
        name: Short name: the stem of its files, and its label in LaTeX.
        caption: What it shows, without a final full stop.
        columns: What people see.
        rows: Values with full precision; CSV and JSON carry all of them, shown or not.
        data: What CSV and JSON carry instead, where people see another arrangement.
        notes: Sentences below it.
        compared: The keys that rows must agree in to be compared with each other; the best of such rows is
            bold. None where rows are not to be compared.
        parted: The keys whose change starts a new part of the table.
    """

    name: str
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    compared: tuple[str, ...] | None = None
    parted: tuple[str, ...] = ()
    data: tuple[Row, ...] | None = None

    @property
    def records(self) -> tuple[Row, ...]:
        """What CSV and JSON carry."""
        return self.rows if self.data is None else self.data

    def best_cells(self) -> frozenset[tuple[int, str]]:
        """Return row and key of the best values; none where all that are compared look the same."""
        if self.compared is None:
            return frozenset()
        groups: dict[tuple[Any, ...], list[int]] = {}
        for i, row in enumerate(self.rows):
            groups.setdefault(_values(row, self.compared), []).append(i)
        return frozenset(
            (i, column.key)
            for column in self.columns
            if column.best
            for rows in groups.values()
            for i in self._best_rows(column, rows)
        )

    def begins_part(self, i: int) -> bool:
        """Tell whether row ``i`` starts a new part."""
        return i > 0 and _values(self.rows[i], self.parted) != _values(self.rows[i - 1], self.parted)

    def groups(self, columns: Sequence[Column]) -> list[tuple[str, int]]:
        """Return the headings above some of its columns, each with the number of columns it spans."""
        found: list[tuple[str, int]] = []
        for column in columns:
            if found and found[-1][0] == column.group:
                found[-1] = (column.group, found[-1][1] + 1)
            else:
                found.append((column.group, 1))
        return found

    def _best_rows(self, column: Column, rows: list[int]) -> list[int]:
        known_rows = [i for i in rows if known(self.rows[i].get(column.key))]
        shown = {i: value_text(self.rows[i][column.key], column.format) for i in known_rows}
        if len(set(shown.values())) < 2:
            return []
        pick = max if column.best == "largest" else min
        top = pick(known_rows, key=lambda i: float(self.rows[i][column.key]))
        return [i for i in known_rows if shown[i] == shown[top]]


def panels(columns: Sequence[Column], fits: Callable[[Sequence[Column]], bool]) -> list[list[Column]]:
    """Return columns in as few panels as fit: the columns of text that name a row are in each.

    Columns under one heading stay together. A panel of one such block may be too wide.

    Args:
        columns: All that are to be shown, those that name a row first.
        fits: Whether columns fit beside each other.
    """
    if fits(columns):
        return [list(columns)]
    count = next((i for i, column in enumerate(columns) if column.right and column.format != "g"), 0)
    names: list[Column] = list(columns[:count])
    found: list[list[Column]] = [[]]
    for block in _blocks(columns[count:]):
        if found[-1] and not fits([*names, *found[-1], *block]):
            found.append([])
        found[-1] += block
    return [[*names, *panel] for panel in found]


def _blocks(columns: Sequence[Column]) -> list[list[Column]]:
    """Return columns with those together that share a heading above."""
    blocks: list[list[Column]] = []
    for column in columns:
        if column.group and blocks and blocks[-1][0].group == column.group:
            blocks[-1].append(column)
        else:
            blocks.append([column])
    return blocks


def plain_table(
    name: str, rows: Rows, caption: str = "", keys: Sequence[str] = (), notes: Sequence[str] = ()
) -> Table:
    """Return rows of the same kind as a table whose headings are their keys.

    Args:
        name: See `Table`.
        rows: Plain values.
        caption: See `Table`.
        keys: The keys to show, in order; by default those of the first row.
        notes: See `Table`.
    """
    columns = tuple(Column(key, key, format=_kind(rows, key)) for key in keys or (rows[0] if rows else ()))
    return Table(name, caption, columns, tuple(rows), tuple(notes))


def known(value: Any) -> bool:
    """Tell whether there is a value: not None, not nan."""
    return value is not None and value == value  # nan is the one value that differs from itself


def value_text(value: Any, form: str = SIGNIFICANT) -> str:
    """Return a value as people read it: booleans in words, lists with commas, a dash where there is none."""
    if isinstance(value, list | tuple):
        return ", ".join(value_text(item, form) for item in value)
    if hasattr(value, "item"):  # of NumPy
        value = value.item()
    if not known(value):
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    if not math.isfinite(value) or form in ("", SIGNIFICANT):
        return _significant(value)
    return format(value, form)


def _significant(value: float) -> str:
    """Return a number with three significant digits; whole numbers keep all of theirs."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    size = abs(value)
    if not _READABLE[0] <= size < _READABLE[1]:
        return f"{value:.{_DIGITS - 1}e}"
    leading = math.floor(math.log10(size))
    return f"{value:.{max(0, _DIGITS - 1 - leading)}f}"


def _like(value: Any, text: str, form: str) -> str:
    """Return a spread with as many decimals as the value it stands behind."""
    if "e" in text or form not in ("", SIGNIFICANT):
        return value_text(value, form)
    decimals = len(text.partition(".")[2])
    written = f"{float(value):.{decimals}f}"
    return written if float(written) or not float(value) else value_text(float(value))


def _kind(rows: Rows, key: str) -> str:
    """Return the format of a key's values: of numbers where all are."""
    values = [row.get(key) for row in rows]
    return SIGNIFICANT if all(_is_number(value) for value in values if known(value)) else ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _values(row: Row, keys: Sequence[str]) -> tuple[Any, ...]:
    return tuple(row.get(key) if known(row.get(key)) else None for key in keys)
