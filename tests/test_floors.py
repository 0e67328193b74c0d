"""The floors of the house: packages import only from floors below their own."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROW = re.compile(r"^\| (\d+) \| ([a-z_, ]+) \|$", re.MULTILINE)


def floors() -> dict[str, int]:
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    return {name.strip(): int(floor) for floor, names in ROW.findall(text) for name in names.split(",")}


def imports() -> Iterator[tuple[str, str, str]]:
    for path in [*(ROOT / "graspbench").rglob("*.py"), *(ROOT / "cli").rglob("*.py")]:
        parts = path.relative_to(ROOT).with_suffix("").parts
        package = "cli" if parts[0] == "cli" else parts[1]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
                if node.module == "graspbench":
                    names = [f"graspbench.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            else:
                continue
            for name in names:
                if name.startswith("graspbench."):
                    yield package, name.split(".")[1], path.relative_to(ROOT).as_posix()


def test_every_package_has_a_floor():
    rooms = {path.parent.name for path in (ROOT / "graspbench").glob("*/__init__.py")} | {"cli"}
    assert rooms <= set(floors())


def test_imports_point_down():
    floor = floors()
    wrong = {
        f"{path} ({package}, floor {floor[package]}) imports {used} (floor {floor[used]})"
        for package, used, path in imports()
        if package not in (used, "__init__") and floor[used] >= floor[package]
    }
    assert not wrong, "\n".join(sorted(wrong))


def test_only_simulation_imports_pybullet():
    users = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "graspbench").rglob("*.py")
        if re.search(r"^\s*(import pybullet|from pybullet)\b", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert users
    assert all(user.startswith("graspbench/simulation/") for user in users)
