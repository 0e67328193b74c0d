"""What an experiment of the thesis gives."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Say = Callable[[str], None]
"""Takes one line about the progress."""


@dataclass(frozen=True)
class PaperResult:
    """What an experiment gives.

    Attributes:
        rows: The rows of its table.
        document: The machine-readable document.
        files: Tables and pictures that were written.
    """

    rows: Sequence[dict[str, Any]]
    document: dict[str, Any]
    files: Sequence[Path]
