"""How long each stage takes, compilation apart."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from graspbench.compiled import seconds_compiling

if TYPE_CHECKING:
    from graspbench.planning.search.engine import Progress

T = TypeVar("T")

COMPILING = "compiling"


@dataclass
class Watch:
    """What a trial is at, for whoever looks on from another thread; each field is set at once.

    Attributes:
        stage: The stage that is under way; empty between two.
        began: When it began, by `time.perf_counter`, s.
        search: How far the global search is, while there is one; it changes as the search goes on.
    """

    stage: str = ""
    began: float = 0.0
    search: "Progress | None" = None

    def follow(self, progress: "Progress") -> None:
        """Look at a search from now on."""
        self.search = progress

    @contextmanager
    def at(self, stage: str) -> Iterator[None]:
        """Name the stage that a block is."""
        before = self.stage, self.began
        self.stage, self.began = stage, time.perf_counter()
        try:
            yield
        finally:
            self.stage, self.began = before
            self.search = None


class StageClock:
    """Measures the stages of a trial and tells a listener when each one ends.

    Inner loops are compiled when they are first used, which takes longer than they run. A stage in which
    that happened is named in `compiled`, and its seconds are those of a run without: it is run again where
    that changes nothing (`run`), else the compilation is taken off (`stage`).

    Args:
        on_stage: Called with the stage's name and its seconds.
        watch: Is told which stage is under way.
    """

    def __init__(
        self, on_stage: Callable[[str, float], None] | None = None, watch: Watch | None = None
    ) -> None:
        self.watch = watch or Watch()
        self.seconds: dict[str, float] = {}
        self.compiled: list[str] = []
        self._on_stage = on_stage

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a block; a stage that runs several times adds up."""
        started, compiling = time.perf_counter(), seconds_compiling()
        with self.watch.at(name):
            yield
        spent = seconds_compiling() - compiling
        self._note(name, spent)
        self.add(name, time.perf_counter() - started - spent)

    def run(self, name: str, work: Callable[[], T]) -> T:
        """Time a function that may be called twice, and return what it gives."""

        def timed() -> T:
            started = time.perf_counter()
            result = work()
            self.add(name, time.perf_counter() - started)
            return result

        return self.run_timed(name, timed)

    def run_timed(self, name: str, work: Callable[[], T]) -> T:
        """Call a function that adds its own stages; call it again when code was compiled in it."""
        before, listener, compiling = dict(self.seconds), self._on_stage, seconds_compiling()
        heard: list[tuple[str, float]] = []
        self._on_stage = lambda *stage: heard.append(stage)
        try:
            with self.watch.at(name):
                result = work()
        finally:
            self._on_stage = listener
        spent = seconds_compiling() - compiling
        if spent > 0.0:
            self._note(name, spent)
            self.seconds = before
            with self.watch.at(name):
                return work()
        for stage in heard:
            self._tell(*stage)
        return result

    def add_compiled(self, name: str, seconds: float, compiling_s: float) -> None:
        """Record a stage that was timed elsewhere, where compilation may have been needed besides."""
        self._note(name, compiling_s)
        self.add(name, seconds)

    def add(self, name: str, seconds: float) -> None:
        """Record a stage that was timed elsewhere."""
        self.seconds[name] = self.seconds.get(name, 0.0) + seconds
        self._tell(name, seconds)

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

    def _note(self, name: str, compiling_s: float) -> None:
        if compiling_s > 0.0:
            if name not in self.compiled:
                self.compiled.append(name)
            self._tell(COMPILING, compiling_s)

    def _tell(self, name: str, seconds: float) -> None:
        if self._on_stage is not None:
            self._on_stage(name, seconds)
