"""Reconstruction and planning at the same time (thesis 3.1: the parallel approach)."""

import threading
from collections.abc import Iterable, Iterator
from queue import SimpleQueue
from time import perf_counter

from graspbench.reconstruction.surface import Surface


class TimedSurfaces:
    """Surfaces in lockstep with the planner: the next one is made when it is asked for.

    Args:
        surfaces: Where they come from, lazily.

    Attributes:
        busy_s: Time spent on making surfaces.
        made: Number of surfaces made.
        last: The latest surface made; None before the first.
    """

    def __init__(self, surfaces: Iterable[Surface]) -> None:
        self._surfaces = surfaces
        self.busy_s = 0.0
        self.made = 0
        self.last: Surface | None = None

    def __iter__(self) -> Iterator[Surface]:
        source = iter(self._surfaces)
        while True:
            started = perf_counter()
            surface = next(source, None)
            self.busy_s += perf_counter() - started
            if surface is None:
                return
            self.made += 1
            self.last = surface
            yield surface


class ConcurrentSurfaces:
    """Surfaces made in a thread of their own; the planner reads one after the other.

    The compiled surface dynamics and the compiled planner both leave Python's global lock, so two cores
    work at the same time. Surfaces that the planner is too slow for wait for it, none is skipped: so it ends
    on the same grasp as in lockstep, whatever the timing.

    Args:
        surfaces: Where they come from, lazily; they are made in the other thread.

    Attributes:
        busy_s: Time from the first surface's start to the last one's end.
        made: Number of surfaces made.
    """

    def __init__(self, surfaces: Iterable[Surface]) -> None:
        self._surfaces = surfaces
        self.busy_s = 0.0
        self.made = 0
        self._waiting: SimpleQueue[Surface | None] = SimpleQueue()
        self._error: BaseException | None = None
        self._stopped = False

    def __iter__(self) -> Iterator[Surface]:
        worker = threading.Thread(target=self._make, name="reconstruction", daemon=True)
        worker.start()
        try:
            while (surface := self._waiting.get()) is not None:
                yield surface
        finally:
            self._stopped = True
            worker.join()
        if self._error is not None:
            raise self._error

    def _make(self) -> None:
        started = perf_counter()
        try:
            for surface in self._surfaces:
                self.made += 1
                self.busy_s = perf_counter() - started
                self._waiting.put(surface)
                if self._stopped:
                    break
        except BaseException as error:
            self._error = error
        finally:
            self._waiting.put(None)
