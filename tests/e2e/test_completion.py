"""Completion of commands, options and values, also in a real bash, zsh and fish."""

import os
import pty
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from graspbench.cli.arguments import complete_override
from graspbench.cli.option_values import OPTION_VALUES, STATISTICS
from graspbench.config.reference import option_values
from graspbench.report import statistics


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("obj", "object="),
        ("object=te", "object=teddy"),
        ("object=teddy,du", "object=teddy,duck"),
        ("hand=", "hand=allegro"),
        ("index.k_", "index.k_cm="),
        ("stations.in", "stations.inner.count="),
        ("scene.renderer=t", "scene.renderer=tiny"),
        ("planner.restart=", "planner.restart=true"),
        ("contact=s", "contact=soft"),
    ],
)
def test_completion_offers_groups_options_keys_and_values(typed, offered):
    assert offered in complete_override(typed)


def test_what_stands_in_a_list_is_not_offered_again():
    assert "object=duck,duck" not in complete_override("object=duck,d")


def test_values_are_the_schemas():
    assert option_values() == OPTION_VALUES
    assert STATISTICS == statistics.STATISTICS


SHELLS = {  # arguments, preparation, and how to get to the end of the line: zsh would take a space back
    "bash": (["--norc", "--noprofile", "-i"], "bind 'set bell-style none'", "\x05"),
    "zsh": (["-f", "-i"], "autoload -U compinit; compinit -u", ""),
}


@pytest.fixture(scope="module", params=SHELLS)
def shell(request, tmp_path_factory):
    """Return what a line becomes when the tabulator is pressed at its end, in an interactive shell."""
    name = request.param
    if shutil.which(name) is None:
        pytest.skip(f"there is no {name}")
    arguments, prepared, to_end = SHELLS[name]
    folder = tmp_path_factory.mktemp(name)
    bin_dir = str(Path(sys.executable).parent)
    environment = os.environ | {
        "PATH": f"{bin_dir}:{os.environ['PATH']}",
        "TERM": "dumb",
        "HOME": str(folder),
        "PS1": "",
        "PS2": "",
    }
    shown = subprocess.run(
        ["graspbench", "--show-completion", name],
        env=environment | {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    (folder / "script").write_text(shown.stdout)
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(folder)
        os.execvpe(name, [name, *arguments], environment)

    def read_until(pattern: str, seconds: float = 120.0) -> re.Match[str]:
        seen, end = "", time.monotonic() + seconds
        while time.monotonic() < end:
            if select.select([terminal], [], [], 0.2)[0]:
                seen += os.read(terminal, 65536).decode(errors="replace")
                if found := re.search(pattern, seen):
                    return found
        raise AssertionError(f"{name} said {seen!r}")

    os.write(terminal, f"{prepared}; source ./script; echo READY-$((1+1))\n".encode())
    read_until("READY-2")

    def complete(line: str) -> str:
        # then the line is printed instead of run: echo is put before it, and a mark behind it
        os.write(terminal, f"{line}\t".encode())
        os.write(terminal, f"{to_end}]'\x01echo '[\x0a".encode())
        return read_until(r"\r\n\[([^\r]*)\]\r\n").group(1)

    yield complete
    os.kill(process, 9)
    os.waitpid(process, 0)
    os.close(terminal)


@pytest.mark.parametrize(
    ("line", "completed"),
    [
        ("graspbench ru", "graspbench run "),
        ("graspbench run object=duc", "graspbench run object=duck "),
        ("graspbench run hand.fi", "graspbench run hand.fingers="),
        ("graspbench sweep object=teddy,duc", "graspbench sweep object=teddy,duck "),
        ("graspbench run scene.renderer=ti", "graspbench run scene.renderer=tiny "),
        ("graspbench objects show tedd", "graspbench objects show teddy "),
        ("graspbench run --outp", "graspbench run --output "),
        ("graspbench report x --stat mean,med", "graspbench report x --stat mean,median "),
        ("graspbench report ./scri", "graspbench report ./script "),
    ],
)
def test_a_shell_completes(shell, line, completed):
    assert shell(line) == completed


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("graspbench run object=duc", ["object=duck"]),
        ("graspbench sweep object=teddy,duc", ["object=teddy,duck"]),
        ("graspbench run hand.fi", ["hand.fingers="]),
        ("graspbench run scene.renderer=ti", ["scene.renderer=tiny"]),
    ],
)
def test_fish_completes(tmp_path, line, offered):
    if shutil.which("fish") is None:
        pytest.skip("there is no fish")
    environment = os.environ | {
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "HOME": str(tmp_path),
        "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
    }
    program = f'graspbench --show-completion fish | source; complete -C "{line}"'
    done = subprocess.run(
        ["fish", "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    assert [word.split("\t")[0] for word in done.stdout.split("\n") if word] == offered
