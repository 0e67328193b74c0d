"""Where a result comes from: code, libraries, machine, time."""

import dataclasses
import os
import platform
import subprocess
import time
from datetime import UTC, datetime
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import graspbench
from graspbench.results.trial_result import ProvenanceResult

_LIBRARIES = (
    "numpy",
    "scipy",
    "numba",
    "pybullet",
    "opencv-python-headless",
    "trimesh",
    "pin",
    "proxsuite",
    "hydra-core",
    "mcap",
)


def provenance(started: float | None = None, host: bool = False) -> ProvenanceResult:
    """Return the provenance that every result carries.

    Args:
        started: When the trial was begun, seconds since the epoch; None if that is not known.
        host: Whether to name the machine.
    """
    now = time.time()
    return dataclasses.replace(
        _fixed_provenance(),
        started=None if started is None else _stamp(started),
        finished=_stamp(now),
        seconds=None if started is None else now - started,
        process=os.getpid(),
        host=platform.node() if host else None,
    )


def _stamp(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds")


@lru_cache(maxsize=1)
def _fixed_provenance() -> ProvenanceResult:
    return ProvenanceResult(
        graspbench=_version("graspbench"),
        git=_git_state(),
        python=platform.python_version(),
        libraries={name: _version(name) for name in _LIBRARIES},
        platform=platform.platform(),
        cpu=_cpu_name(),
        cores=os.cpu_count(),
    )


def described_version() -> str:
    """Return the version, and the commit when the package runs from its own checkout."""
    git = _git_state()
    if git is None:
        return f"graspbench {_version('graspbench')}"
    changed = ", with changed files" if git["dirty"] else ""
    return f"graspbench {_version('graspbench')} (commit {str(git['commit'])[:10]}{changed})"


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None


def _git_state() -> dict[str, object] | None:
    """Return commit and cleanliness when the package runs from its own checkout."""
    root = Path(graspbench.__path__[0]).parent
    if not (root / ".git").exists():
        return None
    try:
        commit = _git(root, "rev-parse", "HEAD")
        dirty = bool(_git(root, "status", "--porcelain", "--untracked-files=no"))
    except (OSError, subprocess.SubprocessError):
        return None
    return {"commit": commit, "dirty": dirty}


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(root), *arguments], capture_output=True, text=True, check=True, timeout=10
    )
    return done.stdout.strip()


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
