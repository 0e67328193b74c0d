"""Where the trials of a sweep are run: the group ``engine`` of the command line.

An engine decides nothing about a result, so it is no part of a trial's configuration or identity.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from graspbench.config.side_group import option_content, parsed_value, validated
from graspbench.errors import ConfigurationError

GROUP = "engine"
MAX_JOBS_PER_CORE = 4


@dataclass(frozen=True)
class EngineParameters:
    """Where and how many trials at a time."""

    name: Annotated[
        Literal["local", "inline", "slurm"],
        Field(description="local: worker processes here; inline: this process; slurm: jobs of a cluster"),
    ] = "local"
    jobs: Annotated[
        int, Field(ge=1, le=10_000, description="Trials at a time (local), jobs at a time (slurm)")
    ] = 1
    trials_per_job: Annotated[
        int, Field(ge=1, le=20_000, description="Trials that one slurm job runs in turn")
    ] = 10
    resubmissions: Annotated[
        int, Field(ge=0, le=1000, description="How often the trials of a lost slurm job are submitted again")
    ] = 2
    cluster: Annotated[
        Literal["slurm", "local"],
        Field(description="What takes the jobs; local: plain processes, to try engine=slurm without SLURM"),
    ] = "slurm"
    partition: Annotated[
        str | None,
        Field(pattern=r"^[\w.,+-]+$", description="SLURM partition; null: the default one"),
    ] = None
    minutes: Annotated[int, Field(ge=1, le=525_600, description="Wall time of a slurm job, min")] = 120
    cpus: Annotated[int, Field(ge=1, le=10_000, description="CPUs of a slurm job")] = 1
    memory_gb: Annotated[
        float | None, Field(ge=0.1, le=100_000, description="Memory of a slurm job; null: default")
    ] = None
    silence_s: Annotated[
        float,
        Field(
            ge=1,
            le=604_800,
            description="A worker is ended whose trial ends no stage for search.time_limit_s and so long, s",
        ),
    ] = 1800.0
    poll_s: Annotated[float, Field(ge=0.1, le=60, description="How often slurm is asked about jobs, s")] = 2.0


def split_engine(overrides: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the overrides of the engine, and those of the trials."""
    ours = [text for text in overrides if text.split("=", 1)[0].split(".", 1)[0] == GROUP]
    return ours, [text for text in overrides if text not in ours]


def load_engine(
    overrides: Sequence[str] = (), config_dir: Path | None = None, jobs: int | None = None
) -> EngineParameters:
    """Compose and validate an engine from its overrides.

    Args:
        overrides: For example ``["engine=slurm", "engine.partition=short"]``.
        config_dir: A user's folder that may hold further options ``engine/<name>.yaml``.
        jobs: What ``--jobs`` says; 0 means in this process. None leaves it to the overrides.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    choice, values = "local", {}
    for text in overrides:
        key, value = parsed_value(text, GROUP)
        if key == GROUP:
            choice = str(value)
        else:
            values[key.removeprefix(f"{GROUP}.")] = value
    if jobs == 0:
        choice = "inline"
    elif jobs is not None:
        values["jobs"] = jobs
    content = {**option_content(GROUP, choice, config_dir), **values}
    engine = validated(EngineParameters, content, GROUP)
    if engine.name == "local":
        check_jobs(engine.jobs)
    return engine


def check_jobs(jobs: int) -> None:
    """Refuse more processes than this machine can bear.

    Raises:
        ConfigurationError: There are too many; the message says how many there may be.
    """
    most = MAX_JOBS_PER_CORE * len(os.sched_getaffinity(0))
    if jobs > most:
        raise ConfigurationError(
            f"{jobs} jobs at a time are too many for this machine", remedy=f"give at most {most}"
        )
