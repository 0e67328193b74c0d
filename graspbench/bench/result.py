"""What a benchmark gives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

Rows = Sequence[Mapping[str, object]]


@dataclass(frozen=True)
class BenchResult:
    """Rows of a benchmark and the pictures drawn of them.

    Attributes:
        name: The benchmark.
        rows: Plain values, the same keys in every row.
        figures: Picture files.
        tables: Further rows, by name.
        shown: The rows' keys that people see first; empty for all.
    """

    name: str
    rows: tuple[dict[str, object], ...]
    figures: tuple[Path, ...] = ()
    tables: Mapping[str, tuple[dict[str, object], ...]] = field(default_factory=dict)
    shown: tuple[str, ...] = ()
