"""How results look on a terminal: stdout carries results, stderr progress.

Nothing that is printed here is read as markup: names of files and objects may hold brackets.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from graspbench.experiment import to_json

if TYPE_CHECKING:
    from graspbench.report.tables import Table

out = Console(soft_wrap=True, markup=False, emoji=False)
err = Console(stderr=True, soft_wrap=True, markup=False, emoji=False)

_UNLIMITED = 10_000


def print_json(document: Any) -> None:
    """Print one JSON document on stdout."""
    print(to_json(document), end="")


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


def print_table(table: "Table") -> None:
    """Print a table: as wide as the terminal, or as it needs where there is none."""
    from graspbench.report.tables import to_terminal

    if out.is_terminal:
        out.print(to_terminal(table, out.width))
    else:
        Console(width=_UNLIMITED, markup=False).print(to_terminal(table))


def counted(number: int, thing: str) -> str:
    """Return ``1 trial`` or ``2 trials``."""
    return f"{number} {thing}{'' if number == 1 else 's'}"
