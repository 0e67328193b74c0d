"""What is kept on disk of compiled kernels."""

import importlib
import sys
from pathlib import Path

import pytest

import graspbench

CALLED = """
from graspbench.compiled import inner

FACTOR = {factor}

@inner
def called(x):
    return {expression}
"""

CALLER = """
from graspbench.compiled import compiled
from kernels_called import FACTOR, called

@compiled
def caller(x):
    return called(x) * FACTOR
"""


@pytest.fixture
def caller(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "kernels_caller.py").write_text(CALLER)

    def load(factor, expression):
        (tmp_path / "kernels_called.py").write_text(CALLED.format(factor=factor, expression=expression))
        importlib.invalidate_caches()
        for name in ("kernels_called", "kernels_caller"):
            sys.modules.pop(name, None)
            Path(importlib.util.cache_from_source(str(tmp_path / f"{name}.py"))).unlink(missing_ok=True)
        return importlib.import_module("kernels_caller").caller

    yield load
    for name in ("kernels_called", "kernels_caller"):
        sys.modules.pop(name, None)


def test_a_kernel_is_compiled_anew_when_what_it_calls_or_reads_in_another_file_changes(caller):
    for factor, expression, value in ((1.0, "x + 1.0", 3.0), (1.0, "x + 2.0", 4.0), (5.0, "x + 2.0", 20.0)):
        kernel = caller(factor, expression)
        assert kernel(2.0) == value
        assert not kernel.stats.cache_hits
    kernel = caller(5.0, "x + 2.0")
    assert kernel(2.0) == 20.0
    assert kernel.stats.cache_hits


def test_nothing_is_kept_in_a_way_that_forgets_what_a_kernel_calls():
    root = Path(graspbench.__file__).parent
    assert not [path for path in root.rglob("*.py") if "cache=True" in path.read_text()]
