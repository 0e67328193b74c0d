"""What goes on is told while it lasts: on a line that changes on a terminal, now and then elsewhere."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from rich.live import Live
from rich.text import Text

from graspbench.cli.printing import err

_FIRST_S, _THEN_S = 3.0, 10.0
"""Where there is no terminal, what lasts is mentioned after so long, and then again and again."""
_LOOK_S = 0.25


@dataclass(frozen=True)
class Activity:
    """What is going on.

    Attributes:
        name: What it is.
        since: When it began, by `time.perf_counter`, s.
        more: What else there is to say of it, such as how far it is.
    """

    name: str
    since: float = field(default_factory=time.perf_counter)
    more: tuple[str, ...] = ()


class Ticker:
    """Tells on stderr what goes on, as a context manager.

    Args:
        activity: Returns what goes on just now; None for nothing that is worth a word. Called from
            another thread.
        live: Whether a terminal gets a line that changes; else it is told like a file, now and then.
        first_s: Seconds after which it is mentioned first where there is no such line.
    """

    def __init__(
        self, activity: Callable[[], Activity | None], live: bool = True, first_s: float | None = None
    ) -> None:
        self._activity = activity
        self._first_s = _FIRST_S if first_s is None else first_s
        self.started = time.perf_counter()
        self._over = threading.Event()
        self._live = (
            Live(
                get_renderable=self._line,
                console=err,
                refresh_per_second=4,
                transient=True,
                redirect_stdout=False,
                redirect_stderr=False,
            )
            if live and err.is_terminal
            else None
        )
        self._thread = threading.Thread(target=self._tell_now_and_then, daemon=True)

    def __enter__(self) -> "Ticker":
        if self._live is not None:
            self._live.start()
        else:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._live is not None:
            self._live.stop()
        else:
            self._thread.join()

    def _tell_now_and_then(self) -> None:
        told, due = ("", 0.0), 0.0
        while not self._over.wait(_LOOK_S):
            now, activity = time.perf_counter(), self._activity()
            if activity is None:
                continue
            if (activity.name, activity.since) != told:
                told, due = (activity.name, activity.since), activity.since + self._first_s
            if now >= due:
                due = now + _THEN_S
                err.print(self._line())

    def _line(self) -> Text:
        now, activity = time.perf_counter(), self._activity()
        if activity is None:
            return Text("")
        words = (f"{activity.name} for {now - activity.since:.0f} s so far", *activity.more)
        return Text.assemble((f"{now - self.started:7.2f} s", "dim"), f"  ... {', '.join(words)}")


class Saying(Ticker):
    """Prints what it is told, and how long that lasts until the next word comes.

    Args:
        first: What goes on at first; not printed, unless it lasts.
        live: See `Ticker`; not for who prints to stdout meanwhile.
    """

    def __init__(self, first: str, live: bool = True) -> None:
        self._last = Activity(first)
        super().__init__(lambda: self._last, live)

    def __enter__(self) -> "Saying":
        super().__enter__()
        return self

    def now(self, name: str, *more: str) -> None:
        """Tell from now on that something goes on; the same with more to say of it has gone on since then."""
        since = self._last.since if name == self._last.name else time.perf_counter()
        self._last = Activity(name, since, more)

    def say(self, text: str) -> None:
        """Print a line, and tell from now on that what it says goes on."""
        err.print(text)
        self._last = Activity(f"the work after '{text.splitlines()[0][:60]}'" if text else self._last.name)
