"""What happens inside a worker: one trial after the other, in a process that may die alone."""

import contextlib
import ctypes
import faulthandler
import os
import resource
import select
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

from graspbench.config.engine import EngineParameters
from graspbench.config.trial_config import TrialConfig
from graspbench.results.store import ResultStore, writable
from graspbench.sweep.watchdog import own_memory, send
from graspbench.threads import share_threads
from graspbench.trial.runner import Listener, failed_result, fault_file, run_and_store

PRELOADED = "graspbench.sweep.preload"
_TRACEBACK_BEFORE_TIMEOUT_S = 0.5
# The watchdog sees memory that is used; far more, asked for at once, fails where it is asked for.
_MAX_AT_ONCE_BYTES = 4 << 30
# What the C library may keep of freed memory before it is told to give it back, which takes some 10 ms.
_MAX_KEPT_BYTES = 96 << 20

_settled_bytes = 0
_line: Connection | None = None


@dataclass(frozen=True)
class PendingTrial:
    """One trial that a sweep wants run.

    Attributes:
        config: The trial.
        version: The result's version (`ResultStore.version`) when the sweep was planned: a later one
            means that somebody else has run the trial meanwhile.
    """

    config: TrialConfig
    version: int | None


@dataclass(frozen=True)
class Limits:
    """What a trial may take.

    Attributes:
        timeout_s: Wall time; None for no limit.
        memory_mb: Memory beyond what its process holds when the trial begins; None for no limit.
        silence_s: Wall time without a stage that ends, beyond the search's own limit.
    """

    timeout_s: float | None = None
    memory_mb: float | None = None
    silence_s: float = EngineParameters.silence_s


def start_worker(sweep_process: int, line: Connection | None = None, jobs: int = 1) -> None:
    """Prepare a worker process: load everything, leave Ctrl-C to the sweep, never outlive it.

    Args:
        sweep_process: The process that runs the sweep.
        line: Where to tell the watchdog what is done.
        jobs: Workers of the sweep, which share the cores.
    """
    global _line
    _line = line
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_die_with, args=(sweep_process,), daemon=True).start()
    with contextlib.suppress(Exception):  # else workers would be started for ever; the trial will say why
        import graspbench.trial.pipeline  # noqa: F401  loads every stage

        share_threads(jobs)


def _die_with(process: int) -> None:
    """End this process as soon as another one has ended, which it may do without a word (SIGKILL)."""
    with contextlib.suppress(ProcessLookupError):  # it is gone already
        select.select([os.pidfd_open(process)], [], [])
    os._exit(1)


def run_task(task: PendingTrial, root: Path, on_stage: Listener | None = None) -> bool:
    """Run a trial and store its result, unless it is there by now.

    Args:
        task: The trial.
        root: The results folder.
        on_stage: Called with each stage's name and seconds.

    Returns:
        Whether the result is stored; False when another process has claimed the trial.
    """
    store, trial_id = ResultStore(root), task.config.trial_id
    with store.claim(trial_id) as ours:
        if ours and store.version(trial_id) == task.version:
            run_and_store(task.config, store, on_stage=on_stage, contain=True)
    return ours


def run_limited(task: PendingTrial, root: Path, limits: Limits) -> bool:
    """Do `run_task` within limits, as a worker process does.

    The time limit and the memory limit are kept by who started the process.
    """
    trial_id = task.config.trial_id
    tell = partial(send, _line, trial_id=trial_id)
    tell("begin")
    try:
        with _last_words(fault_file(root, trial_id), limits.timeout_s), _limited_at_once(limits.memory_mb):
            return run_task(task, root, lambda _stage, _seconds: tell("stage"))
    except MemoryError:  # where nothing contains it: while the trial was stored
        store = ResultStore(root)
        with store.claim(trial_id):
            failed_result(task.config, store, "failed", "memory: the trial needed more than its limit.")
        return True
    finally:
        give_memory_back()
        tell("end")


def give_memory_back(most_kept: int = _MAX_KEPT_BYTES) -> None:
    """Have the C library give freed memory back, if it may have kept more than so many bytes.

    Freed arrays leave holes that the next trial fills only in part, so that a worker would grow for hundreds
    of trials though nothing leaks.
    """
    global _settled_bytes
    if own_memory() <= _settled_bytes + most_kept:
        return
    with contextlib.suppress(AttributeError, OSError):  # not glibc
        ctypes.CDLL(None).malloc_trim(0)
    _settled_bytes = own_memory()


@contextmanager
def _limited_at_once(limit_mb: float | None) -> Iterator[None]:
    """Let an allocation of gigabytes beyond the limit fail, as `MemoryError` where Python sees it."""
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if limit_mb is not None:
        limit = _private_memory() + int(limit_mb * 2**20) + _MAX_AT_ONCE_BYTES
        resource.setrlimit(resource.RLIMIT_DATA, (limit if hard < 0 else min(limit, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (hard, hard))


def _private_memory() -> int:
    """Return this process' private writable memory in bytes, as RLIMIT_DATA counts it."""
    pages = Path("/proc/self/statm").read_text().split()[5]
    return int(pages) * os.sysconf("SC_PAGE_SIZE")


@contextmanager
def _last_words(path: Path, timeout_s: float | None) -> Iterator[None]:
    """Leave a traceback in a file when the process is killed by a signal or by the time limit."""
    with writable(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)  # whatever a folder that came from somebody has there
        opened = path.open("x", encoding="utf-8")
    with opened as stream:
        faulthandler.enable(stream)
        if timeout_s is not None:
            early = max(0.9 * timeout_s, timeout_s - _TRACEBACK_BEFORE_TIMEOUT_S)
            faulthandler.dump_traceback_later(early, file=stream)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
            faulthandler.disable()
            path.unlink(missing_ok=True)
