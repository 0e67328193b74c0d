"""The wheel holds the whole package and works from another folder."""

import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    out = tmp_path_factory.mktemp("wheel")
    source = out / "source"
    tracked = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files"], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in tracked:
        if (ROOT / name).is_file() and not name.startswith(("tests/", "docs/")):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = out.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(out / "site")
    return out / "site"


def test_every_module_and_yaml_file_of_the_tree_is_in_the_wheel(unpacked):
    folders = {"graspbench": "graspbench", "cli": "graspbench/cli", "conf": "graspbench/conf"}
    folders["datasets"] = "graspbench/datasets"
    tracked = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", *folders], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    wanted = set()
    for name in tracked:
        top, rest = name.split("/", 1)
        if (
            name.endswith((".py", ".yaml", ".typed", ".js", ".css", ".html", ".json"))
            and (ROOT / name).is_file()
        ):
            wanted.add(f"{folders[top]}/{rest}")
    there = {str(path.relative_to(unpacked)) for path in unpacked.rglob("*") if path.is_file()}
    assert wanted - there == set()


def test_the_wheel_runs_where_it_is_installed(unpacked, tmp_path):
    """In a fresh environment that has the libraries of this one, but not this checkout."""
    fresh, (wheel,) = tmp_path / "fresh", unpacked.parent.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", fresh], check=True)
    python = fresh / "bin/python"
    install = ["-m", "pip", "--python", python, "install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run([sys.executable, *install], check=True, capture_output=True)
    # The libraries of this environment, with what their .pth files add, but not this checkout.
    libraries = Path(sysconfig.get_path("purelib"))
    added = [str(libraries)]
    for file in sorted(libraries.glob("*.pth")):
        if "editable" not in file.name:
            for line in file.read_text().splitlines():
                added.append(line if line.startswith("import ") else str(libraries / line))
    (site,) = fresh.glob("lib/python*/site-packages")
    (site / "libraries.pth").write_text("\n".join(added) + "\n")
    where = [python, "-c", "import graspbench.cli.app as app; print(app.__file__)"]
    told = subprocess.run(where, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert told.stdout.startswith(str(fresh))
    done = subprocess.run(
        [fresh / "bin/graspbench", "config", "object=duck"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "name: duck" in done.stdout


def test_setup_says_what_a_later_python_costs(tmp_path):
    """PyBullet has no wheel for it: without a compiler that is said, before anything is installed."""
    (tmp_path / "scripts").mkdir()
    for name in ("scripts/setup", "requirements.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    python, tools = tmp_path / ".venv/bin/python", tmp_path / "tools"
    python.parent.mkdir(parents=True)
    python.write_text('#!/bin/sh\ncase "$2" in *version_info*) echo 3.13 ;; *) exit 1 ;; esac\n')
    python.chmod(0o755)
    tools.mkdir()
    for name in ("bash", "cat", "cut", "sha256sum", "dirname", "sh"):
        (tools / name).symlink_to(shutil.which(name))
    (tools / "python3.13").symlink_to(sys.executable)
    done = subprocess.run(
        ["bash", tmp_path / "scripts/setup"],
        env={"PATH": str(tools)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "PyBullet is compiled for Python 3.13 (once, about ten minutes" in done.stderr
    assert "there is no C++ compiler" in done.stderr
    assert "installing" not in done.stderr


def test_the_container_is_made_of_what_is_here():
    lines = (ROOT / "Dockerfile").read_text().splitlines()
    copied = [line.split()[1] for line in lines if line.startswith("COPY")]
    assert copied == ["requirements.txt", "."]
    assert all((ROOT / name).exists() for name in copied)
    assert any("--require-hashes -r requirements.txt" in line for line in lines)
    ignored = (ROOT / ".dockerignore").read_text().split()
    needed = ("graspbench", "cli", "conf", "datasets", "pyproject.toml", "README.md", "LICENSE")
    assert not set(ignored) & set(needed)
