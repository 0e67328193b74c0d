"""Many trials: the grid, the engine that runs it, and what becomes of each trial."""

import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import TimeoutError as FutureTimeoutError
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from graspbench.errors import GraspbenchError
from graspbench.experiment.compose import Tree, compose_tree, expand_sweep
from graspbench.experiment.config import TrialConfig, config_from_tree
from graspbench.experiment.runner import failed_result, run_and_store
from graspbench.experiment.store import ResultStore


@dataclass(frozen=True)
class PlannedTrial:
    """One cell of a sweep's grid.

    Attributes:
        overrides: The overrides that make it.
        config: Its configuration.
        state: "new", or the status of the result that is there already.
    """

    overrides: tuple[str, ...]
    config: TrialConfig
    state: str


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is run; nothing here changes a result.

    Attributes:
        jobs: Trials at a time; 0 runs them one by one in this process, for debugging.
        resume: Skip the trials that have a result.
        retry_failed: Run those again whose result is not "done".
        fail_fast: Stop at the first trial that is not "done".
        timeout_s: Wall time a trial may take; None for no limit.
    """

    jobs: int = 1
    resume: bool = True
    retry_failed: bool = False
    fail_fast: bool = False
    timeout_s: float | None = None


def plan_sweep(
    overrides: Sequence[str], store: ResultStore, options: SweepOptions, config_dir: Path | None = None
) -> list[PlannedTrial]:
    """Compose the whole grid and find which of its trials are still to be run.

    Raises:
        ConfigurationError: Any of the trials has an option that cannot be used; nothing is run then.
    """
    planned: dict[str, PlannedTrial] = {}
    for cell in expand_sweep(overrides, config_dir):
        config = config_from_tree(compose_tree(cell, config_dir))
        done = store.result(config.trial_id) if options.resume else None
        state = str(done["status"]) if done else "new"
        if options.retry_failed and state not in {"new", "done"}:
            state = "new"
        planned.setdefault(config.trial_id, PlannedTrial(cell, config, state))
    return list(planned.values())


def run_sweep(
    trials: Sequence[PlannedTrial], store: ResultStore, options: SweepOptions
) -> Iterator[dict[str, Any]]:
    """Run the new trials of a grid and yield each result as it is finished and stored.

    A trial that raises, hangs or takes its process down becomes a result with status "failed", "timeout"
    or "crashed" and never touches the others.
    """
    new = [trial for trial in trials if trial.state == "new"]
    results = _run_inline(new, store) if options.jobs == 0 else _run_in_processes(new, store, options)
    for result in results:
        yield result
        if options.fail_fast and result["status"] != "done":
            return


def _run_inline(trials: Sequence[PlannedTrial], store: ResultStore) -> Iterator[dict[str, Any]]:
    for trial in trials:
        yield _run_one(trial.config.as_tree(), store.root)


def _run_in_processes(
    trials: Sequence[PlannedTrial], store: ResultStore, options: SweepOptions
) -> Iterator[dict[str, Any]]:
    """Run trials in worker processes that stay warm and may die alone."""
    from pebble import ProcessExpired, ProcessPool

    pool = ProcessPool(max_workers=options.jobs, context=get_context("spawn"))
    try:
        futures = {
            pool.schedule(
                _run_one, args=(trial.config.as_tree(), store.root), timeout=options.timeout_s
            ): trial.config
            for trial in trials
        }
        for future in _as_completed(futures):
            config = futures[future]
            try:
                yield future.result()
            except FutureTimeoutError:
                reason = f"the trial took longer than {options.timeout_s:g} s"
                yield _store_failure(config, store, "timeout", reason)
            except ProcessExpired as error:
                reason = f"the trial's process ended with exit code {error.exitcode}"
                yield _store_failure(config, store, "crashed", reason)
    finally:
        pool.stop()
        pool.join()


def _as_completed(futures: dict[Any, TrialConfig]) -> Iterator[Any]:
    from concurrent.futures import as_completed

    yield from as_completed(futures)


def _run_one(tree: Tree, root: Path) -> dict[str, Any]:
    """Run and store one trial; whatever it raises becomes its result."""
    store, config = ResultStore(root), config_from_tree(tree)
    try:
        return run_and_store(config, store)
    except GraspbenchError as error:
        return _store_failure(config, store, "failed", str(error))
    except Exception as error:
        details = "".join(traceback.format_exception(error))
        return _store_failure(config, store, "failed", f"unexpected {type(error).__name__}: {error}", details)


def _store_failure(
    config: TrialConfig, store: ResultStore, status: str, reason: str, details: str | None = None
) -> dict[str, Any]:
    return failed_result(config, store, status, reason, details)


ProgressListener = Callable[[dict[str, Any]], None]
