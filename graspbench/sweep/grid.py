"""Many trials: the grid, and the engine that runs it."""

import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from graspbench.config.engine import EngineParameters, check_jobs
from graspbench.config.grid import expand_sweep
from graspbench.config.trial_config import TrialConfig, kind_of, load_any_config
from graspbench.results.store import ResultStore
from graspbench.results.trial_result import TrialResult
from graspbench.sweep.worker import Limits, PendingTrial, run_task


@dataclass(frozen=True)
class SweepTrial:
    """One cell of a sweep's grid.

    Attributes:
        overrides: The overrides that make it.
        config: Its configuration.
        state: "new", or the status of the result that is there already.
        version: The version of the result that is there, if any (`ResultStore.version`).
    """

    overrides: tuple[str, ...]
    config: TrialConfig
    state: str
    version: int | None = None


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is run; nothing here changes a result.

    Attributes:
        jobs: Trials at a time of the engine ``local``; 0 runs them one by one in this process.
        resume: Skip the trials that have a result.
        retry_failed: Run those again whose result is not "done".
        fail_fast: Stop at the first trial that is not "done".
        timeout_s: Wall time a trial may take; None for no limit.
        memory_mb: Memory a trial may take beyond its worker's own; None for no limit.
        engine: Where the trials are run; None for ``jobs`` processes on this machine.
    """

    jobs: int = 1
    resume: bool = True
    retry_failed: bool = False
    fail_fast: bool = False
    timeout_s: float | None = None
    memory_mb: float | None = None
    engine: EngineParameters | None = None
    stop: threading.Event = field(default_factory=threading.Event, compare=False)


def plan_sweep(
    overrides: Sequence[str], store: ResultStore, options: SweepOptions, config_dir: Path | None = None
) -> list[SweepTrial]:
    """Compose the whole grid and find which of its trials are still to be run.

    A grid over a motion, a contact or the inverse kinematics is one of in-hand motions.

    Raises:
        ConfigurationError: Any of the trials has an option that cannot be used; nothing is run then.
    """
    planned: dict[str, SweepTrial] = {}
    primary = kind_of(overrides, config_dir)
    for cell in expand_sweep(overrides, config_dir, primary):
        config = load_any_config(cell, config_dir, primary)
        trial_id = config.trial_id
        if trial_id in planned:
            continue
        version = store.version(trial_id)
        done = store.result(trial_id) if options.resume and version is not None else None
        state = str(done.status) if done else "new"
        if options.retry_failed and state not in {"new", "done"}:
            state = "new"
        planned[trial_id] = SweepTrial(cell, config, state, version)
    return list(planned.values())


def run_sweep(
    trials: Sequence[SweepTrial], store: ResultStore, options: SweepOptions
) -> Iterator[TrialResult]:
    """Run the new trials of a grid and yield each result as it is finished and stored.

    A trial that raises, hangs or takes its process down becomes a result with status "failed", "timeout"
    or "crashed" and never touches the others. Setting ``options.stop`` ends the sweep after the trials that
    are running.
    """
    tasks = [PendingTrial(trial.config, trial.version) for trial in trials if trial.state == "new"]
    results = _engine(tasks, store, options)
    for result in results:
        yield result
        if options.fail_fast and result.status != "done":
            options.stop.set()


def _engine(
    tasks: Sequence[PendingTrial], store: ResultStore, options: SweepOptions
) -> Iterator[TrialResult]:
    engine = options.engine or _default_engine(options.jobs)
    limits = Limits(options.timeout_s, options.memory_mb, engine.silence_s)
    if not tasks:
        return iter(())
    if engine.name == "inline":
        return _run_inline(tasks, store, options)
    if engine.name == "slurm":
        from graspbench.sweep.slurm_engine import run_slurm

        return run_slurm(tasks, store.root, engine, limits, options.stop)
    from graspbench.sweep.local_engine import run_local

    return run_local(tasks, store.root, engine.jobs, limits, options.stop)


def _default_engine(jobs: int) -> EngineParameters:
    check_jobs(jobs)
    return EngineParameters(jobs=jobs) if jobs else EngineParameters(name="inline")


def _run_inline(
    tasks: Sequence[PendingTrial], store: ResultStore, options: SweepOptions
) -> Iterator[TrialResult]:
    for task in tasks:
        if options.stop.is_set():
            return
        if run_task(task, store.root):
            result = store.result(task.config.trial_id)
            assert result is not None, "it has just been stored"
            yield result
