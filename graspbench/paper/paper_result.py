"""What an experiment of the thesis gives."""

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Images, surface and choice of the grasp of the thesis, whatever the defaults of a trial have become.
AS_IN_THE_THESIS = ("surface=thesis", "stations=thesis", "stations.fit=false")

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


@contextmanager
def published(output: Path) -> Iterator[Path]:
    """Give a folder whose files move to ``output`` at the end, or are gone when the block fails."""
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output.parent, prefix=f".{output.name}.") as name:
        folder = Path(name)
        yield folder
        output.mkdir(exist_ok=True)
        for path in sorted(folder.iterdir()):
            os.replace(path, output / path.name)
