"""What happens inside a worker: one trial after the other, in a process that may die alone."""

import contextlib
import faulthandler
import os
import resource
import select
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from graspbench.config.trial_config import TrialConfig
from graspbench.results.store import ResultStore
from graspbench.trial.runner import fault_file, run_and_store

PRELOADED = ("graspbench.sweep.worker", "graspbench.trial.pipeline")
_TRACEBACK_BEFORE_TIMEOUT_S = 0.5


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
    """

    timeout_s: float | None = None
    memory_mb: float | None = None


def start_worker(sweep_process: int) -> None:
    """Prepare a worker process: load everything, leave Ctrl-C to the sweep, never outlive it.

    Args:
        sweep_process: The process that runs the sweep.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_die_with, args=(sweep_process,), daemon=True).start()
    with contextlib.suppress(Exception):  # else workers would be started for ever; the trial will say why
        import graspbench.trial.pipeline  # noqa: F401  loads every stage


def _die_with(process: int) -> None:
    """End this process as soon as another one has ended, which it may do without a word (SIGKILL)."""
    with contextlib.suppress(ProcessLookupError):  # it is gone already
        select.select([os.pidfd_open(process)], [], [])
    os._exit(1)


def run_task(task: PendingTrial, root: Path) -> bool:
    """Run a trial and store its result, unless it is there by now.

    Returns:
        Whether the result is stored; False when another process has claimed the trial.
    """
    store, trial_id = ResultStore(root), task.config.trial_id
    with store.claim(trial_id) as ours:
        if ours and store.version(trial_id) == task.version:
            run_and_store(task.config, store, contain=True)
    return ours


def run_limited(task: PendingTrial, root: Path, limits: Limits) -> bool:
    """Do `run_task` within limits, as a worker process does.

    The time limit itself is kept by who started the process.
    """
    last_words = fault_file(root, task.config.trial_id)
    with _last_words(last_words, limits.timeout_s), _memory_limited(limits.memory_mb):
        return run_task(task, root)


@contextmanager
def _memory_limited(limit_mb: float | None) -> Iterator[None]:
    """Let an allocation beyond the limit fail, as `MemoryError` where Python sees it."""
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if limit_mb is not None:
        limit = _private_memory() + int(limit_mb * 2**20)
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
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8") as stream:
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
