"""Every command and every Python block of the documentation is run; what is generated is in step."""

import json
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.e2e.conftest import cli  # noqa: F401  the real command line, in this process
from tests.small import SMALL_TRIAL

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```(sh|python|yaml)\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = sorted(
    path.relative_to(DOCS).as_posix()
    for path in DOCS.rglob("*.md")
    if "_build" not in path.parts and BLOCK.search(path.read_text(encoding="utf-8"))
)

# What a page says runs as it stands, but for its cost: few small pictures, a coarse surface, no simulation;
# of a sweep, which is planned whole, the last value of each list, and of the longest the first too.
CHEAP = (*SMALL_TRIAL, "record.pictures=false", "record.level=scores")
MOVING = ("clik.step_s=0.005", "clik.integrator=rk4")  # fewer steps of a motion in the hand
GAIT = ("motion.gait.turn_speed_deg_s=40",)
COSTLY = {"run", "manipulate", "sweep", "tune"}


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_says_runs(page, cli, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text(encoding="utf-8")
    for language, block in BLOCK.findall(text):
        if language == "python":
            exec(compile(block, page, "exec"), {})
        elif language == "yaml":
            name, content = re.fullmatch(r"# file: (\S+)\n(.*)", block, re.DOTALL).groups()
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            Path(name).write_text(content, encoding="utf-8")
        else:
            for line in block.replace("\\\n", " ").splitlines():
                _run(line, cli)


def _run(line, cli):  # noqa: F811
    program, *arguments = shlex.split(line)
    assert program == "graspbench", line
    if arguments[0] in COSTLY and "--dry-run" not in arguments:
        chosen = {word.split("=")[0] for word in arguments}
        arguments += [word for word in CHEAP if not (word.startswith("record") and "record" in chosen)]
        arguments += MOVING if "motion" in chosen else ()
        arguments += GAIT if "motion=gait" in arguments else ()
        alone = arguments[0] in ("run", "manipulate") or "engine=slurm" in arguments
        arguments += [] if alone else ["--jobs", "0"]
        if arguments[0] == "sweep":
            planned = cli(*arguments, "--dry-run", cwd=Path.cwd())
            assert planned.code == 0, f"{line}\n{planned.stderr[-1000:]}"
            longest = max(arguments, key=lambda word: len(_values(word)))
            arguments = [_few(word, 2 if word == longest else 1) for word in arguments]
    finished = cli(*arguments, cwd=Path.cwd())
    assert finished.code == 0, f"{line}\n{finished.stdout[-500:]}\n{finished.stderr[-1000:]}"


def _values(word):
    """Return the values of an override that lists several."""
    _, _, values = word.partition("=")
    if span := re.fullmatch(r"range\(0,(\d+)\)", values):
        return [str(value) for value in range(int(span[1]))]
    return values.split(",") if "," in values and re.fullmatch(r"[\w.,]+", values) else []


def _few(word, count):
    """Return an override with the last value of its list, or with the first and the last."""
    values = _values(word)
    if not values:
        return word
    return f"{word.partition('=')[0]}={','.join(values[-1:] if count == 1 else (values[0], values[-1]))}"


def test_configuration_reference_is_in_step(cli):  # noqa: F811
    written = (DOCS / "reference/configuration.md").read_text(encoding="utf-8")
    assert written == cli("config", "--reference").stdout, (
        "run: graspbench config --reference > docs/reference/configuration.md"
    )


def test_columns_reference_is_in_step(cli):  # noqa: F811
    written = (DOCS / "reference/columns.md").read_text(encoding="utf-8")
    assert written == cli("config", "--columns").stdout, (
        "run: graspbench config --columns > docs/reference/columns.md"
    )


def test_python_reference_is_in_step(capsys):
    runpy.run_path(str(DOCS.parent / "scripts/api"), run_name="__main__")
    written = (DOCS / "reference/python.md").read_text(encoding="utf-8")
    assert written == capsys.readouterr().out, "run: .venv/bin/python scripts/api > docs/reference/python.md"


@pytest.mark.parametrize("path", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs(path, capsys):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    names = {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec"), names)
            assert cell["outputs"] == []  # what a run printed is not stored: it would go stale
    assert "done" in capsys.readouterr().out


def test_every_picture_of_the_pages_has_a_script_that_draws_it():
    script = (DOCS.parent / "scripts/pictures").read_text(encoding="utf-8")
    for page in (DOCS.parent / "README.md", *DOCS.rglob("*.md")):
        for name in re.findall(r"\]\((?:\.\./|docs/)*assets/([\w-]+)\.(?:png|gif)\)", page.read_text()):
            assert (DOCS / "assets" / f"{name}.png").is_file() or (DOCS / "assets" / f"{name}.gif").is_file()
            assert re.search(rf"\b{name}\b", script), f"{page.name}: scripts/pictures draws no {name}"


def test_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-b", "html", str(DOCS), str(tmp_path / "site")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site" / "tutorial.html").is_file()
