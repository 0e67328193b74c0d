"""The engine ``slurm``: chunks of trials as jobs of a cluster, by submitit.

A job runs its trials in worker processes of its own, so one that crashes takes no other with it, and stores
each result in the shared results folder. A job that is preempted or requeued begins again and skips what is
stored; the trials of a job that is lost altogether are submitted again.
"""

import errno
import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspbench.config.engine import EngineParameters
from graspbench.errors import ConfigurationError
from graspbench.results.store import ResultStore, writable
from graspbench.results.trial_result import TrialResult
from graspbench.sweep.worker import Limits, PendingTrial
from graspbench.trial.runner import failed_result

JOBS_FOLDER = ".jobs"
_TERMINATED = 128 + signal.SIGTERM
_GOODBYE_S = 30.0  # a job whose trials are all stored ends by itself: its workers say goodbye


@dataclass(frozen=True)
class Chunk:
    """What one job does: some trials, one after the other.

    Attributes:
        tasks: The trials.
        root: The results folder.
        limits: Time and memory of each trial.
    """

    tasks: tuple[PendingTrial, ...]
    root: Path
    limits: Limits

    def __call__(self) -> int:
        """Run the trials that are not stored yet; return how many were run."""
        from graspbench.sweep.local_engine import run_local

        # A job that is cancelled or requeued ends at once: what its workers do then is no trial's fault.
        signal.signal(signal.SIGTERM, lambda *_: os._exit(_TERMINATED))
        store = ResultStore(self.root)
        left = [task for task in self.tasks if not is_stored(task, store)]
        return sum(1 for _ in run_local(left, self.root, 1, self.limits, threading.Event()))

    def checkpoint(self) -> Any:
        """Say how to go on after a preemption: the same again, stored trials are skipped."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


@dataclass(frozen=True)
class _Submitted:
    """A chunk and its job; ``attempt`` counts from 0."""

    job: Any
    chunk: Chunk
    attempt: int


def run_slurm(
    tasks: Sequence[PendingTrial], root: Path, engine: EngineParameters, limits: Limits, stop: threading.Event
) -> Iterator[TrialResult]:
    """Submit trials in chunks and yield each result when it is stored.

    Args:
        tasks: The trials.
        root: The results folder, on a file system that the cluster's nodes share.
        engine: Size of the chunks, resources of a job.
        limits: Time and memory of each trial.
        stop: Once set, the jobs are cancelled.

    Raises:
        ConfigurationError: There is no SLURM here.
    """
    store = ResultStore(root.resolve())
    executor = _executor(store.root, engine)
    size = engine.trials_per_job
    chunks = [Chunk(tuple(tasks[i : i + size]), store.root, limits) for i in range(0, len(tasks), size)]
    submitted: list[_Submitted] = []
    waiting = {task.config.trial_id: task for task in tasks}
    try:
        while waiting and not stop.is_set():
            # SLURM itself holds back what exceeds the jobs at a time; plain processes would all run.
            room = len(chunks) if engine.cluster == "slurm" else engine.jobs - len(submitted)
            submitted += _submit(executor, chunks[:room], 0)
            del chunks[:room]
            alive = _alive(submitted)
            for task in [task for task in waiting.values() if is_stored(task, store)]:
                del waiting[task.config.trial_id]
                yield _result(task, store)
            lost = [entry for entry in submitted if entry.job.job_id not in alive]
            submitted = [entry for entry in submitted if entry.job.job_id in alive]
            for entry in lost:
                left = tuple(task for task in entry.chunk.tasks if not is_stored(task, store))
                if left and entry.attempt < engine.resubmissions:
                    again = Chunk(left, store.root, entry.chunk.limits)
                    submitted += _submit(executor, [again], entry.attempt + 1)
                elif left:
                    _give_up(left, entry, store)
            if waiting and not lost:
                stop.wait(engine.poll_s)
    finally:
        _leave_nothing_running(submitted, 0.0 if waiting else _GOODBYE_S, engine)


def is_stored(task: PendingTrial, store: ResultStore) -> bool:
    """Tell whether a trial's result has been written since the sweep was planned."""
    return store.version(task.config.trial_id) not in {None, task.version}


def _executor(root: Path, engine: EngineParameters) -> Any:
    import submitit

    folder = _new_folder(root / JOBS_FOLDER)
    try:
        executor = submitit.AutoExecutor(folder=folder / "%j", cluster=engine.cluster)
    except RuntimeError as error:
        folder.rmdir()
        with suppress(OSError):
            folder.parent.rmdir()
        raise ConfigurationError(
            "engine=slurm finds no SLURM here (no srun)",
            remedy="start the sweep on a login node, or set engine.cluster=local to try it",
        ) from error
    executor.update_parameters(
        name="graspbench",
        timeout_min=engine.minutes,
        cpus_per_task=engine.cpus,
        slurm_array_parallelism=engine.jobs,
        slurm_use_srun=False,
        stderr_to_stdout=True,
    )
    if engine.memory_gb is not None:
        executor.update_parameters(mem_gb=engine.memory_gb)
    if engine.partition is not None:
        executor.update_parameters(slurm_partition=engine.partition)
    return executor


def _new_folder(parent: Path) -> Path:
    """Make a folder for the jobs of this sweep alone, under a name that nobody could foresee.

    submitit hands jobs their work as pickles, which are programs, in files named by the jobs' numbers, and a
    job that starts at once reads what is there: in a results folder that came from somebody, maybe theirs.
    """
    with writable(parent):
        parent.mkdir(parents=True, exist_ok=True)
        if parent.is_symlink():
            raise OSError(errno.ELOOP, "it is a link")
        return Path(tempfile.mkdtemp(dir=parent, prefix=time.strftime("%Y%m%d-")))


def _submit(executor: Any, chunks: Sequence[Chunk], attempt: int) -> list[_Submitted]:
    if not chunks:
        return []
    with executor.batch():
        jobs = [executor.submit(chunk) for chunk in chunks]
    return [_Submitted(job, chunk, attempt) for job, chunk in zip(jobs, chunks, strict=True)]


def _alive(submitted: Sequence[_Submitted]) -> set[str]:
    """Return the ids of the jobs that wait or run.

    SLURM's own queue is asked: accounting, which submitit would ask, is not set up everywhere.
    """
    jobs = {entry.job.job_id: entry.job for entry in submitted}
    on_slurm = [job_id for job_id, job in jobs.items() if type(job).__name__ == "SlurmJob"]
    alive = {job_id for job_id, job in jobs.items() if job_id not in on_slurm and not job.done()}
    if on_slurm:
        masters = ",".join(sorted({job_id.split("_")[0] for job_id in on_slurm}))
        command = ["squeue", "--noheader", "--array", "--jobs", masters, "--format", "%i"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0 and "Invalid job id" not in done.stderr:
            return set(jobs)  # the controller does not answer: ask again later
        alive |= set(done.stdout.split()) & set(on_slurm)
    return alive


def _leave_nothing_running(
    submitted: Sequence[_Submitted], patience_s: float, engine: EngineParameters
) -> None:
    """Wait for jobs to end by themselves, cancel those that do not, and wait for plain processes."""
    end = time.monotonic() + patience_s
    while (alive := _alive(submitted)) and time.monotonic() < end:
        time.sleep(min(engine.poll_s, 1.0))
    for entry in submitted:
        if entry.job.job_id in alive:
            entry.job.cancel()
        if engine.cluster == "local":
            entry.job.wait()


def _give_up(tasks: Sequence[PendingTrial], entry: _Submitted, store: ResultStore) -> None:
    reason = f"job {entry.job.job_id} and {entry.attempt} before it ended without a result."
    for task in tasks:
        with store.claim(task.config.trial_id):
            failed_result(task.config, store, "crashed", reason, _output(entry.job))


def _output(job: Any) -> str | None:
    path = Path(job.paths.stdout)
    time.sleep(0.1)  # the last lines may still be on their way
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else None


def _result(task: PendingTrial, store: ResultStore) -> TrialResult:
    result = store.result(task.config.trial_id)
    assert result is not None, "it is stored"
    return result
