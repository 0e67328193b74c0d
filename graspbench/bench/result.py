"""What a benchmark gives."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class BenchResult:
    """Rows of a benchmark and the pictures drawn of them.

    Attributes:
        name: The benchmark.
        rows: Plain values, the same keys in every row.
        figures: Picture files.
    """

    name: str
    rows: tuple[dict[str, object], ...]
    figures: tuple[Path, ...] = ()
