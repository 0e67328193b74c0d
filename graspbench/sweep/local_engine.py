"""The engine ``local``: worker processes on this machine that stay warm and may die alone."""

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, wait
from concurrent.futures import TimeoutError as FutureTimeoutError
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from graspbench.errors import GraspbenchError
from graspbench.results.store import ResultStore, is_own_file
from graspbench.results.trial_result import Status, TrialResult
from graspbench.sweep.forking import interrupts_blocked, start_forkserver
from graspbench.sweep.watchdog import Watchdog
from graspbench.sweep.worker import PRELOADED, Limits, PendingTrial, run_limited, start_worker
from graspbench.trial.runner import failed_result, fault_file

_WAIT_S = 0.2
_BUSY_RETRY_S = 1.0
# A signal to the whole group that ends a worker reaches this process within this time, and ends it too.
_SIGNAL_S = 0.5


def run_local(
    tasks: Sequence[PendingTrial], root: Path, jobs: int, limits: Limits, stop: threading.Event
) -> Iterator[TrialResult]:
    """Run trials in ``jobs`` worker processes and yield each result when it is stored.

    Args:
        tasks: The trials.
        root: The results folder.
        jobs: Trials at a time.
        limits: Time and memory of each trial.
        stop: Once set, running trials are finished and no other is begun.
    """
    from pebble import ProcessPool

    store, waiting = ResultStore(root), deque(tasks)
    context = get_context("forkserver")  # a worker that has died is replaced within milliseconds
    start_forkserver(PRELOADED)
    watchdog = Watchdog(context, limits.memory_mb)
    about = (os.getpid(), watchdog.line, jobs)
    pool = ProcessPool(max_workers=jobs, context=context, initializer=start_worker, initargs=about)
    with interrupts_blocked():
        _ = pool.active  # starts its threads, which start the forking process anew should it die
    running: dict[Any, PendingTrial] = {}
    try:
        while running or (waiting and not stop.is_set()):
            while waiting and len(running) < jobs and not stop.is_set():
                task = waiting.popleft()
                watchdog.expect(task.config.trial_id, limits.silence_s + task.config.search.time_limit_s)
                future = _scheduled(pool, (task, root, limits), limits.timeout_s)
                running[future] = task
            finished, _ = wait(running, timeout=_WAIT_S, return_when=FIRST_COMPLETED)
            for future in finished:
                task = running.pop(future)
                result = _outcome(future, task, store, limits, watchdog)
                if result is not None:
                    yield result
                else:
                    _defer(task, waiting, store)
            for future, task in running.items():
                if watchdog.never_begun(task.config.trial_id):
                    future.cancel()
    finally:
        pool.stop()
        pool.join()
        watchdog.close()


def _scheduled(pool: Any, arguments: tuple[PendingTrial, Path, Limits], timeout_s: float | None) -> Any:
    """Give a trial to the pool; one whose forking process was killed takes none any more."""
    try:
        return pool.schedule(run_limited, args=arguments, timeout=timeout_s)
    except RuntimeError as error:
        raise GraspbenchError(
            "the process that starts the workers was killed",
            remedy="give the sweep more memory, and run the same command again: it goes on where it was",
        ) from error


def _outcome(
    future: Any, task: PendingTrial, store: ResultStore, limits: Limits, watchdog: Watchdog
) -> TrialResult | None:
    """Return the result of a trial that has ended, however that was; None when another sweep runs it."""
    from pebble import ProcessExpired

    try:
        stored = future.result()
    except FutureTimeoutError:
        watchdog.forget(task.config.trial_id)
        return _failure(task, store, "timeout", f"the trial took longer than {limits.timeout_s:g} s.")
    except (ProcessExpired, CancelledError) as error:
        verdict = watchdog.forget(task.config.trial_id)
        if verdict is not None:
            return _failure(task, store, verdict.status, verdict.reason)
        time.sleep(_SIGNAL_S)
        how = _how(getattr(error, "exitcode", None))
        return _failure(task, store, "crashed", f"the trial's process ended {how}.")
    watchdog.forget(task.config.trial_id)
    return _stored(task, store) if stored else None


def _defer(task: PendingTrial, waiting: deque[PendingTrial], store: ResultStore) -> None:
    """Put a trial that another sweep is running at the end; it will be there when its turn comes."""
    waiting.append(task)
    if len(waiting) == 1 and store.version(task.config.trial_id) == task.version:
        time.sleep(_BUSY_RETRY_S)


def _stored(task: PendingTrial, store: ResultStore) -> TrialResult:
    result = store.result(task.config.trial_id)
    assert result is not None, "the worker has stored it"
    return result


def _failure(task: PendingTrial, store: ResultStore, status: Status, reason: str) -> TrialResult:
    last_words = fault_file(store.root, task.config.trial_id)
    details = last_words.read_text(encoding="utf-8", errors="replace") if is_own_file(last_words) else None
    with store.claim(task.config.trial_id):
        result = failed_result(task.config, store, status, reason, details)
    last_words.unlink(missing_ok=True)
    return result


def _how(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return f"by signal {signal.Signals(-exit_code).name}"
    return f"with exit code {exit_code}"
