"""How long each stage takes."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


class StageClock:
    """Measures the stages of a trial and tells a listener when each one ends.

    Args:
        on_stage: Called with the stage's name and its seconds.
    """

    def __init__(self, on_stage: Callable[[str, float], None] | None = None) -> None:
        self.seconds: dict[str, float] = {}
        self._on_stage = on_stage

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a block; a stage that runs several times adds up."""
        started = time.perf_counter()
        yield
        self.add(name, time.perf_counter() - started)

    def add(self, name: str, seconds: float) -> None:
        """Record a stage that was timed elsewhere."""
        self.seconds[name] = self.seconds.get(name, 0.0) + seconds
        if self._on_stage is not None:
            self._on_stage(name, seconds)

    def producing(self, name: str, items: Iterable[T], kept: list[T]) -> Iterator[T]:
        """Pass items on, keep them, and time only how long each takes to be produced.

        So two interleaved stages, a producer and its consumer, get their own times.
        """
        iterator, total = iter(items), 0.0
        try:
            while True:
                started = time.perf_counter()
                try:
                    item = next(iterator)
                except StopIteration:
                    return
                finally:
                    total += time.perf_counter() - started
                kept.append(item)
                yield item
        finally:
            self.add(name, total)
