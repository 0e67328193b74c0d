"""Packages whose names load on first use have all the names that they promise, and load no more."""

import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import graspbench

ROOT = Path(graspbench.__path__[0])
PACKAGES = [
    ".".join(("graspbench", *path.parent.relative_to(ROOT).parts))
    for path in sorted(ROOT.rglob("__init__.py"))
    if "loads_on_use(" in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("name", PACKAGES)
def test_every_name_is_there_and_is_no_module(name):
    package = importlib.import_module(name)
    modules = {module.name for module in pkgutil.iter_modules(package.__path__)}
    assert len(package.__all__) > 1
    assert set(package._HOMES) <= set(package.__all__)
    assert not modules & set(package.__all__)  # once it is loaded, a module stands where the name should
    for each in package.__all__:
        assert getattr(package, each).__class__ is not type(package), each


def test_an_unknown_name_is_said():
    with pytest.raises(ImportError, match=r"cannot import name 'no_such'.*graspbench\.grasp"):
        exec("from graspbench.grasp import no_such")  # as anyone would write it


def test_the_floors_know_them_all():
    assert {"graspbench.geometry", "graspbench.planning", "graspbench.experiment"} <= set(PACKAGES)


HEAVY = r"(trimesh|networkx|scipy\.optimize|matplotlib|pybullet|pandas|proxsuite)"


def test_loading_a_configuration_loads_no_stage():
    program = (
        "import sys; from graspbench.config.trial_config import load_config; load_config(['object=duck']);"
        "print('\\n'.join(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert not [name for name in done.stdout.splitlines() if re.fullmatch(HEAVY, name)]
