"""The real command line: in this process, where libraries are loaded once, or in one of its own."""

import contextlib
import io
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from graspbench.cli.app import main


@dataclass(frozen=True)
class Finished:
    code: int
    stdout: str
    stderr: str

    @property
    def document(self) -> Any:
        return json.loads(self.stdout)


Cli = Callable[..., Finished]


@pytest.fixture(scope="session")
def cli(tmp_path_factory: pytest.TempPathFactory) -> Cli:
    """Run ``graspbench ARGUMENTS`` in a folder of its own, or in ``cwd``."""
    anywhere = tmp_path_factory.mktemp("cwd")

    def run(*arguments: object, cwd: Path | None = None) -> Finished:
        out, err, code = io.StringIO(), io.StringIO(), 0
        with (
            contextlib.chdir(cwd or anywhere),
            mock.patch.object(sys, "argv", ["graspbench", *map(str, arguments)]),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            try:
                main()
            except SystemExit as end:
                code = int(end.code or 0)
        return Finished(code, out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session")
def process(tmp_path_factory: pytest.TempPathFactory) -> Cli:
    """Run ``graspbench ARGUMENTS`` as a shell does."""
    anywhere = tmp_path_factory.mktemp("cwd")

    def run(*arguments: object, cwd: Path | None = None) -> Finished:
        done = subprocess.run(
            [sys.executable, "-m", "graspbench.cli", *map(str, arguments)],
            cwd=cwd or anywhere,
            capture_output=True,
            text=True,
            timeout=280,
            check=False,
        )
        return Finished(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture(scope="session")
def teddy_run(process: Cli, tmp_path_factory: pytest.TempPathFactory) -> tuple[Finished, Path]:
    """One whole trial of the default configuration: what it printed, and its results folder."""
    output = tmp_path_factory.mktemp("teddy") / "results"
    return process("run", "--json", "-o", output), output
