"""How a sweep tells how far it is: a bar on a terminal, a line now and then elsewhere."""

import time
from typing import TYPE_CHECKING

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from graspbench.cli.printing import err
from graspbench.cli.ticker import Activity, Ticker

if TYPE_CHECKING:
    from graspbench.experiment import TrialResult

_QUIET_S = 10.0


class SweepProgress:
    """Counts results and shows rate, remaining time and failures on stderr.

    Args:
        total: How many trials are to be run.
        names: What to call each trial, by its id.
    """

    def __init__(self, total: int, names: dict[str, str]) -> None:
        self._total, self._names = total, names
        self._started = self._said = time.monotonic()
        self._done = self._bad = 0
        self._last = time.perf_counter()
        self._ticker = Ticker(self._waiting, live=False, first_s=_QUIET_S)
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[pace]}"),
            console=err,
            disable=not err.is_terminal,
        )
        self._task = self._bar.add_task("trials", total=total, pace="")

    def __enter__(self) -> "SweepProgress":
        self._bar.start()
        if self._bar.disable:
            self._ticker.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.disable:
            self._ticker.__exit__()
        self._bar.stop()

    def add(self, result: "TrialResult") -> None:
        """Count a finished trial; a failure is shown at once, in one line."""
        self._done += 1
        self._last = time.perf_counter()
        if result.status != "done":
            self._bad += 1
            trial_id = result.trial_id
            reason = (result.reason or "").partition("\n")[0]
            name = (self._names.get(trial_id, ""), "dim")
            self._bar.console.print(
                Text.assemble((result.status, "red"), f" {trial_id} ", name, f" {reason}")
            )
        self._bar.update(self._task, completed=self._done, pace=self.pace())
        now = time.monotonic()
        if self._bar.disable and (now - self._said > _QUIET_S or self._done == self._total):
            self._said = now
            err.print(f"{self._done}/{self._total} trials, {self.pace()}")

    def _waiting(self) -> Activity | None:
        """Return what a sweep waits for: told where there is no bar and no trial has ended for a while."""
        if self._done >= self._total:
            return None
        return Activity(f"{self._done}/{self._total} trials: the next", self._last)

    def pace(self) -> str:
        """Return rate, remaining time and number of failures in words."""
        elapsed = time.monotonic() - self._started
        rate = self._done / elapsed if elapsed > 0 else 0.0
        left = (self._total - self._done) / rate if rate > 0 else 0.0
        words = f"{rate * 60:.3g}/min, {_span(left)} left"
        return f"{words}, {self._bad} not done" if self._bad else words


def _span(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
