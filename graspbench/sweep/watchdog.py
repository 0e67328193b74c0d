"""A watch over workers from outside: what memory each holds, and whether it still gives a sign of life.

A limit inside a process is no help against what that process does with it: a library that cannot allocate may
wait for ever on a lock of its own. So a thread of the sweep looks at each worker's resident memory, and ends
the worker, whatever it is in.
"""

import os
import signal
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Literal

from graspbench.results.trial_result import Status

_LOOK_S = 0.05
_LAST_WORDS_S = 1.0
_LOADING_S = 120.0
_KIB = 1024
_MIB = 2**20
# What is the process' own: not the pages of libraries, which all processes share.
_OWN_MEMORY = ("RssAnon:", "RssShmem:", "VmSwap:")

Event = Literal["begin", "stage", "end"]


@dataclass(frozen=True)
class Verdict:
    """Why the watchdog ended a worker.

    Attributes:
        status: Of the trial that it ran.
        reason: One sentence.
    """

    status: Status
    reason: str


@dataclass
class _Watched:
    """A trial that a sweep waits for; ``process`` is a descriptor of the worker that has begun it."""

    silence_s: float
    heard: float = field(default_factory=time.monotonic)
    number: int = 0
    process: int | None = None
    base_bytes: int = 0
    asked_to_end: float | None = None


def own_memory(process: int | None = None) -> int:
    """Return the memory in bytes that a process holds for itself, in RAM or swapped out; 0 when it is gone.

    Args:
        process: Its number; None for this one.
    """
    try:
        lines = Path(f"/proc/{process or 'self'}/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0
    own = (line.split() for line in lines.splitlines() if line.startswith(_OWN_MEMORY))
    return sum(int(words[1]) for words in own) * _KIB


def send(line: Connection | None, event: Event, trial_id: str) -> None:
    """Tell the watchdog what a worker does; a message is one write, so that writers never mix."""
    if line is not None:
        with suppress(OSError):  # the sweep has gone, and this process goes with it
            line.send_bytes(f"{event} {trial_id} {os.getpid()} {own_memory()}".encode())


class Watchdog:
    """Watches workers, and ends those that take too much memory or are silent for too long.

    Args:
        context: What the workers are started with.
        memory_mb: What a trial may take beyond what its worker held when it began; None for no limit.
    """

    def __init__(self, context: BaseContext, memory_mb: float | None) -> None:
        self._reader, self.line = context.Pipe(duplex=False)
        self._memory_mb = memory_mb
        self._watched: dict[str, _Watched] = {}
        self._verdicts: dict[str, Verdict] = {}
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def expect(self, trial_id: str, silence_s: float) -> None:
        """Watch a trial from now on: at most ``silence_s`` may pass without a stage that ends."""
        with self._lock:
            self._watched[trial_id] = _Watched(silence_s)
            self._verdicts.pop(trial_id, None)

    def forget(self, trial_id: str) -> Verdict | None:
        """Watch a trial no longer; return why its worker was ended, if it was."""
        with self._lock:
            self._let_go(trial_id)
            return self._verdicts.pop(trial_id, None)

    def never_begun(self, trial_id: str) -> bool:
        """Tell whether a trial was given up before any worker had begun it."""
        with self._lock:
            watched = self._watched.get(trial_id)
            return trial_id in self._verdicts and watched is not None and watched.process is None

    def close(self) -> None:
        """End the watch; workers are left as they are."""
        self._ended.set()
        self._thread.join()
        for trial_id in list(self._watched):
            self._let_go(trial_id)
        self._reader.close()
        self.line.close()

    def _watch(self) -> None:
        while not self._ended.is_set():
            self._hear(_LOOK_S)
            with self._lock:
                for trial_id, watched in self._watched.items():
                    self._look(trial_id, watched)

    def _hear(self, wait_s: float) -> None:
        """Take in all that workers have said."""
        while self._reader.poll(wait_s):
            event, trial_id, process, memory = self._reader.recv_bytes().decode().split()
            wait_s = 0.0
            with self._lock:
                watched = self._watched.get(trial_id)
                if watched is None:
                    continue
                watched.heard = time.monotonic()
                if event == "begin":
                    watched.number, watched.base_bytes = int(process), int(memory)
                    with suppress(OSError):  # it has died meanwhile
                        watched.process = os.pidfd_open(watched.number)
                elif event == "end":
                    self._let_go(trial_id)

    def _look(self, trial_id: str, watched: _Watched) -> None:
        now = time.monotonic()
        if trial_id in self._verdicts:
            if watched.asked_to_end is not None and now - watched.asked_to_end > _LAST_WORDS_S:
                _end(watched, signal.SIGKILL)
            return
        if self._memory_mb is not None and watched.process is not None:
            taken_mb = (own_memory(watched.number) - watched.base_bytes) / _MIB
            if taken_mb > self._memory_mb:
                self._verdicts[trial_id] = Verdict("failed", _memory_reason(taken_mb, self._memory_mb))
                _end(watched, signal.SIGKILL)
                return
        limit_s = watched.silence_s + (_LOADING_S if watched.process is None else 0.0)
        if now - watched.heard > limit_s:
            reason = f"the trial gave no sign of life for {limit_s:g} s (engine.silence_s)."
            self._verdicts[trial_id] = Verdict("timeout", reason)
            watched.asked_to_end = now
            _end(watched, signal.SIGABRT)  # leaves its last traceback

    def _let_go(self, trial_id: str) -> None:
        watched = self._watched.pop(trial_id, None)
        if watched is not None and watched.process is not None:
            os.close(watched.process)


def _memory_reason(taken_mb: float, limit_mb: float) -> str:
    return f"memory: the trial needed more than its limit ({taken_mb:.0f} of {limit_mb:g} MB)."


def _end(watched: _Watched, how: signal.Signals) -> None:
    if watched.process is not None:
        with suppress(OSError):  # it has ended by itself
            signal.pidfd_send_signal(watched.process, how)
