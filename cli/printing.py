"""How results look on a terminal: stdout carries results, stderr progress.

Nothing that is printed here is read as markup: names of files and objects may hold brackets. Nor does a
terminal obey it: files that somebody else wrote may hold its control characters.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from graspbench.experiment import to_json

if TYPE_CHECKING:
    from graspbench.report.tables import Table

# But for tabs and line feeds; those that turn the direction of writing too.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_UNLIMITED = 10_000


class PlainConsole(Console):
    """A console that shows control characters of a text instead of sending them to the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render, with what a terminal would obey escaped."""
        for segment in super().render(renderable, options):
            if segment.control or not _CONTROL.search(segment.text):
                yield segment
            else:
                text = _CONTROL.sub(lambda found: ascii(found[0])[1:-1], segment.text)
                yield Segment(text, segment.style)


out = PlainConsole(soft_wrap=True, markup=False, emoji=False)
err = PlainConsole(stderr=True, soft_wrap=True, markup=False, emoji=False)


def print_json(document: Any) -> None:
    """Print one JSON document on stdout."""
    print(_CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", to_json(document)), end="")


def print_stage(since_start_s: float, stage: str, seconds: float) -> None:
    """Say on stderr that a stage has ended."""
    err.print(Text.assemble((f"{since_start_s:7.2f} s", "dim"), f"  {stage} ({seconds * 1e3:.0f} ms)"))


def print_failure(reason: object) -> None:
    """Say why a trial failed."""
    out.print(Text.assemble(("failed", "bold red"), f": {reason}"))


def print_rows(
    rows: Sequence[Mapping[str, Any]], title: str | None = None, columns: Sequence[str] | None = None
) -> None:
    """Print rows of the same kind as a table; the columns are those of the first row."""
    from graspbench.report.tables import plain_table

    print_table(plain_table("rows", rows, title or "", columns or ()))


def print_described(described: Mapping[str, Any]) -> None:
    """Print what was found of one thing, a line a key."""
    from graspbench.report.tables import value_text

    for key, value in described.items():
        if isinstance(value, dict):
            value = ", ".join(f"{name}: {each}" for name, each in value.items()) or "none"
        elif isinstance(value, list):
            value = ", ".join(str(each) for each in value) or "none"
        text = value if isinstance(value, str) else value_text(value)
        out.print(f"{key:17} {text}", highlight=False, markup=False, soft_wrap=True)


def print_table(table: "Table") -> None:
    """Print a table: as wide as the terminal, or as it needs where there is none."""
    from graspbench.report.tables import to_terminal

    if out.is_terminal:
        out.print(to_terminal(table, out.width))
    else:
        PlainConsole(width=_UNLIMITED, markup=False).print(to_terminal(table))


def counted(number: int, thing: str) -> str:
    """Return ``1 trial`` or ``2 trials``."""
    return f"{number} {thing}{'' if number == 1 else 's'}"
