"""Compiled kernels are made anew when anything that was compiled into them has changed."""

import subprocess
import sys
from collections import namedtuple
from pathlib import Path

import pytest

import graspbench
from graspbench.compiled import compiled, inner
from graspbench.kernel_cache import fingerprint

_HELPERS = """
from graspbench.compiled import inner
import graspbench.manipulation.compiled.record as record
import numpy as np

FACTOR = {factor}
TABLE = np.array([1.0, {entry}])

@inner
def deep(x):
    return x * {deep}

@inner
def helper(x):
    return FACTOR * deep(x) + TABLE[1]
"""
_KERNEL = """
from graspbench.compiled import compiled
from helpers import helper

@compiled
def kernel(x):
    return later(x)

@compiled
def later(x):
    return helper(x)
"""
_RUN = "from kernels import kernel; print(kernel(2.0), kernel.stats.cache_hits.total())"


def _run(folder, **values):
    (folder / "helpers.py").write_text(_HELPERS.format(**{"factor": 2.0, "entry": 3.0, "deep": 1.0} | values))
    finished = subprocess.run(
        [sys.executable, "-c", _RUN], cwd=folder, capture_output=True, text=True, check=True
    )
    value, hits = finished.stdout.split()
    return float(value), int(hits)


@pytest.mark.parametrize(
    ("changed", "value"), [({"factor": 4.0}, 11.0), ({"entry": 5.0}, 9.0), ({"deep": 2.0}, 11.0)]
)
def test_what_changes_in_another_file_is_compiled_in(tmp_path, changed, value):
    (tmp_path / "kernels.py").write_text(_KERNEL)
    assert _run(tmp_path) == (7.0, 0)
    assert _run(tmp_path) == (7.0, 1)
    assert _run(tmp_path, **changed) == (value, 0)
    assert _run(tmp_path) == (7.0, 1)


def _at_once(folder, *arguments):
    """Call a kernel in as many processes at the same time; return what was found compiled in each."""
    code = "import sys; from kernels import kernel; kernel(eval(sys.argv[1])); "
    code += "print(kernel.stats.cache_hits.total())"
    started = [
        subprocess.Popen([sys.executable, "-c", code, word], cwd=folder, stdout=subprocess.PIPE, text=True)
        for word in arguments
    ]
    return [int(process.communicate(timeout=200)[0]) for process in started]


def test_processes_that_need_a_kernel_at_the_same_time_compile_it_once(tmp_path):
    (tmp_path / "helpers.py").write_text(_HELPERS.format(factor=2.0, entry=3.0, deep=1.0))
    (tmp_path / "kernels.py").write_text(_KERNEL)
    assert sum(_at_once(tmp_path, "2.0", "2.0")) == 1
    assert _at_once(tmp_path, "1j", "2") == [0, 0]
    assert _at_once(tmp_path, "1j", "2") == [1, 1]


def test_a_process_that_dies_as_it_writes_leaves_nothing_wrong(tmp_path):
    (tmp_path / "kernels.py").write_text(_KERNEL)
    assert _run(tmp_path) == (7.0, 0)
    dies = "import os; from graspbench.kernel_cache import _KernelFiles as f; "
    for step, (factor, value) in {"_save_index": (5.0, 13.0), "_save_data": (6.0, 15.0)}.items():
        (tmp_path / "helpers.py").write_text(_HELPERS.format(factor=4.0, entry=3.0, deep=1.0))
        code = dies + f"f.{step} = lambda *_: os._exit(9); import kernels; kernels.kernel(2.0)"
        assert subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False).returncode == 9
        assert _run(tmp_path, factor=factor) == (value, 0)


def test_no_compiled_code_is_kept_that_nothing_leads_to(tmp_path):
    (tmp_path / "kernels.py").write_text(_KERNEL)
    _run(tmp_path)
    _run(tmp_path, factor=3.0)
    assert len(list(tmp_path.rglob("kernels.kernel-*.nbc"))) == 2
    (tmp_path / "kernels.py").write_text(_KERNEL.replace("later(x)", "later(x) + 0.0", 1))
    _run(tmp_path)
    assert len(list(tmp_path.rglob("kernels.kernel-*.nbc"))) == 1


def test_layouts_of_records_count():
    from graspbench.manipulation.compiled.record import Record
    from graspbench.manipulation.compiled.record_type import opener

    def kernel_of(record):
        opened = opener(record)

        @inner
        def helper(block):
            return opened(block).gain

        @compiled
        def kernel(block):
            return helper(block)

        return kernel.py_func

    class One(Record):
        gain: float

    one = One

    class Two(Record):
        other: float
        gain: float

    Two.__qualname__ = One.__qualname__
    assert fingerprint(kernel_of(one)) == fingerprint(kernel_of(one))
    assert fingerprint(kernel_of(one)) != fingerprint(kernel_of(Two))


def test_the_order_of_a_tuples_fields_counts():
    def kernel_of(kind):
        def kernel(values: kind) -> float:
            return values.first

        return kernel

    one, other = namedtuple("Pair", "first second"), namedtuple("Pair", "second first")
    assert fingerprint(kernel_of(one)) == fingerprint(kernel_of(one))
    assert fingerprint(kernel_of(one)) != fingerprint(kernel_of(other))


def test_comments_and_docstrings_do_not_count():
    def first(x: float) -> float:
        """Say one thing."""
        return x + 1.0

    def other(x: float) -> float:
        """Say another."""

        # and a comment
        return x + 1.0

    other.__code__ = other.__code__.replace(co_name="first")
    assert fingerprint(first) == fingerprint(other)
    assert fingerprint(first) != fingerprint(lambda x: x + 2.0)


def test_nothing_is_kept_in_a_way_that_forgets_what_a_kernel_calls():
    package = Path(graspbench.__file__).parent
    assert not [path for path in package.rglob("*.py") if "cache=True" in path.read_text()]
