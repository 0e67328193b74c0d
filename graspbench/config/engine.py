"""Where the trials of a sweep are run: the group ``engine`` of the command line.

An engine decides nothing about a result, so it is no part of a trial's configuration or identity.
"""

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from graspbench.config.groups import CONF_DIR
from graspbench.config.overrides import parse_override
from graspbench.errors import ConfigurationError, shown
from graspbench.yaml_files import check_plain, read_yaml

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
        key, value = _parsed(text)
        if key == GROUP:
            choice = str(value)
        else:
            values[key.removeprefix(f"{GROUP}.")] = value
    if jobs == 0:
        choice = "inline"
    elif jobs is not None:
        values["jobs"] = jobs
    content = {**_option(choice, config_dir), **values}
    known = [field.name for field in dataclasses.fields(EngineParameters)]
    unknown = sorted(set(content) - set(known))
    if unknown:
        raise ConfigurationError(
            f"unknown option 'engine.{unknown[0]}'", remedy=f"choose one of {', '.join(known)}"
        )
    try:
        engine = TypeAdapter(EngineParameters).validate_python(content)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join([GROUP, *(str(part) for part in first["loc"])])
        raise ConfigurationError(
            f"{key} = {shown(first['input'])} cannot be used",
            remedy=first["msg"][:1].lower() + first["msg"][1:],
        ) from error
    most = MAX_JOBS_PER_CORE * len(os.sched_getaffinity(0))
    if engine.name == "local" and engine.jobs > most:
        raise ConfigurationError(
            f"{engine.jobs} trials at a time are too many for this machine", remedy=f"give at most {most}"
        )
    return engine


def _parsed(text: str) -> tuple[str, Any]:
    override = parse_override(text)
    if override.is_sweep_override() or override.is_delete():
        raise ConfigurationError(f"'{text}' is no single value", remedy="give one engine to a sweep")
    value = override.value()
    return override.key_or_group, getattr(value, "text", value)


def _option(choice: str, config_dir: Path | None) -> dict[str, Any]:
    roots = [root for root in (config_dir, CONF_DIR) if root is not None]
    for root in roots:
        path = root / GROUP / f"{choice}.yaml"
        if path.is_file():
            content = read_yaml(path)
            if not isinstance(content, dict | None):
                raise ConfigurationError(f"{path} is no mapping of options", remedy="write KEY: VALUE lines")
            check_plain(content, GROUP)
            return {str(key): value for key, value in (content or {}).items()}
    names = sorted({path.stem for root in roots for path in (root / GROUP).glob("*.yaml")})
    raise ConfigurationError(f"unknown engine '{choice}'", remedy=f"choose one of {', '.join(names)}")
