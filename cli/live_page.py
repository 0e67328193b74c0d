"""The page of a study that is running, written anew as its results come."""

import time
from pathlib import Path

from graspbench.cli.printing import err

_LEAST_S, _SHARE = 2.0, 10.0
"""The page is written at most this often, and takes at most this share of the time."""


class LivePage:
    """Writes a results folder's page after a result, unless it has just done so.

    Args:
        root: The results folder.
        total: How many trials the study has.
        done: How many of them were there before.
    """

    def __init__(self, root: Path, total: int, done: int) -> None:
        self._root, self._total, self._done = root, total, done
        self._due = 0.0
        self._told = False

    def add(self) -> None:
        """Count a result; write the page if it is time."""
        self._done += 1
        now = time.monotonic()
        if now >= self._due:
            self._write(f"running: {self._done} of {self._total} trials are there")
            self._due = time.monotonic() + max(_LEAST_S, _SHARE * (time.monotonic() - now))

    def finish(self) -> None:
        """Write the page of a study that is over, or was stopped."""
        if self._done:
            self._write(None)

    def _write(self, running: str | None) -> None:
        from graspbench.report.results_page import write_results_page

        path = write_results_page(
            [self._root], self._root / "report", running, "auto" if running is None else "link"
        )
        if not self._told:
            self._told = True
            err.print(f"page      {path.resolve()}")
