"""Compilation ahead of the first trial: what fails in it is said."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from graspbench.trial.warm_up import work_together

ROOT = Path(__file__).parents[2]


def test_a_piece_of_work_that_ends_badly_is_named_after_all_have_ended():
    done = []
    with pytest.raises(SystemExit, match="abort ended with -6"):
        work_together(lambda: done.append(True), os.getpid, os.abort)
    assert done == [True]
    work_together(os.getpid, os.getpid)


@pytest.mark.parametrize(
    ("fails", "said"),
    [
        ("pins-1.txt", "the pinned libraries cannot be installed"),
        ("pins-dev.txt", "the tools for tests and checks cannot be installed"),
        ("graspbench.trial.warm_up", "the inner loops cannot be compiled"),
        ("nothing", None),
    ],
)
def test_setup_ends_where_a_step_fails_and_goes_on_at_the_next_call(tmp_path, fails, said):
    """With a Python that notes what it is asked for, and refuses one thing."""
    (tmp_path / "scripts").mkdir()
    for name in ("scripts/setup", "requirements.txt", "requirements-dev.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    tools = tmp_path / ".venv/bin"
    tools.mkdir(parents=True)
    for name in ("python", "graspbench"):
        (tools / name).write_text(
            '#!/bin/sh\ncase "$*" in\n'
            f"  *{fails}*) echo broken >&2; exit 3 ;;\n"
            "  *version_info*) echo 3.11 ;;\n"
            f'  *pins*) for last; do :; done; cat "$last" >>{tmp_path}/installed ;;\n'
            "esac\n"
        )
        (tools / name).chmod(0o755)
    command = ["bash", tmp_path / "scripts/setup", "--dev"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    stamped = list((tmp_path / ".venv").glob(".graspbench-*"))
    if said is not None:
        assert done.returncode == 1
        assert "broken" in done.stderr
        assert said in done.stderr
        assert stamped == []
        return
    assert done.returncode == 0, done.stderr
    assert len(stamped) == 1
    installed = (tmp_path / "installed").read_text().splitlines()
    assert sorted(installed) == sorted((tmp_path / "requirements-dev.txt").read_text().splitlines())
