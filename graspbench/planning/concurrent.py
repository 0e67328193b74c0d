"""Reconstruction and planning at the same time (thesis 3.1: the parallel approach)."""

import threading
from collections.abc import Iterable, Iterator
from time import perf_counter

from graspbench.reconstruction.surface import Surface


class TimedSurfaces:
    """Surfaces in lockstep with the planner: the next one is made when it is asked for.

    Args:
        surfaces: Where they come from, lazily.

    Attributes:
        busy_s: Time spent on making surfaces.
        made: Number of surfaces made.
    """

    def __init__(self, surfaces: Iterable[Surface]) -> None:
        self._surfaces = surfaces
        self.busy_s = 0.0
        self.made = 0

    def __iter__(self) -> Iterator[Surface]:
        source = iter(self._surfaces)
        while True:
            started = perf_counter()
            surface = next(source, None)
            self.busy_s += perf_counter() - started
            if surface is None:
                return
            self.made += 1
            yield surface


class ConcurrentSurfaces:
    """Surfaces made in a thread of their own; the planner reads the newest one.

    The compiled surface dynamics and the compiled planner both leave Python's global lock, so two cores
    work at the same time. Surfaces that the planner is too slow for are skipped; the first one and the last
    one, which is at rest, never are.

    Args:
        surfaces: Where they come from, lazily; they are made in the other thread.

    Attributes:
        busy_s: Time from the first surface's start to the last one's end.
        made: Number of surfaces made, the skipped ones included.
    """

    def __init__(self, surfaces: Iterable[Surface]) -> None:
        self._surfaces = surfaces
        self.busy_s = 0.0
        self.made = 0
        self._changed = threading.Condition()
        self._newest: Surface | None = None
        self._finished = False
        self._error: BaseException | None = None
        self._stopped = False

    def __iter__(self) -> Iterator[Surface]:
        worker = threading.Thread(target=self._make, name="reconstruction", daemon=True)
        worker.start()
        try:
            while (surface := self._take()) is not None:
                yield surface
        finally:
            self._stopped = True
            with self._changed:
                self._changed.notify_all()
            worker.join()
        if self._error is not None:
            raise self._error

    def _make(self) -> None:
        started = perf_counter()
        try:
            for surface in self._surfaces:
                with self._changed:
                    # The planner starts on the first surface, whatever comes after.
                    while self.made == 1 and self._newest is not None and not self._stopped:
                        self._changed.wait()
                    self._newest = surface
                    self.made += 1
                    self.busy_s = perf_counter() - started
                    self._changed.notify_all()
                if self._stopped:
                    break
        except BaseException as error:
            self._error = error
        finally:
            with self._changed:
                self._finished = True
                self._changed.notify_all()

    def _take(self) -> Surface | None:
        with self._changed:
            while self._newest is None and not self._finished:
                self._changed.wait()
            surface, self._newest = self._newest, None
            self._changed.notify_all()
            return surface
