"""A trial that outgrows its memory, or falls silent, is that trial's failure, whatever allocates or waits."""

from mmap import mmap

import numpy as np
import pandas as pd
import pytest

from graspbench.sweep.watchdog import own_memory
from graspbench.sweep.worker import give_memory_back
from tests.sweep import planting


@pytest.fixture(scope="module")
def plugin(tmp_path_factory):
    return planting.install(tmp_path_factory.mktemp("plugin"))


def swept(plugin, output, *arguments):
    process = planting.sweep(plugin, output, *arguments)
    _, errors = process.communicate(timeout=120)
    assert process.returncode in (0, 1), errors
    assert "Traceback" not in errors
    return pd.read_csv(output / "trials.csv")


def test_memory_is_counted_as_it_is_used():
    size = 2**26
    before = own_memory()
    with mmap(-1, size) as hoard:  # new pages: an array may lie in what this process has freed before
        np.frombuffer(hoard, dtype=np.uint8)[:] = 1
        assert own_memory() - before >= 0.9 * size
    assert own_memory(2**22 + 1) == 0  # no such process


def test_memory_that_is_free_is_given_back():
    give_memory_back(0)
    before = own_memory()
    blocks = [bytes(50_000) for _ in range(4000)]  # small enough for the heap, which ends where the last is
    pinned = blocks[::100]
    full = own_memory()
    assert full - before > 150_000_000
    del blocks
    give_memory_back(1 << 40)
    assert own_memory() > full - 150_000_000  # no more is kept than it may be
    give_memory_back()
    assert own_memory() - before < 40_000_000
    assert len(pinned) == 40


def test_whatever_allocates_is_ended_and_the_rest_goes_on(plugin, tmp_path):
    faults = "index.fault=memory,memory_of_c,address_space,none"
    table = swept(plugin, tmp_path / "r", faults, "--memory", "500").set_index("index.fault")
    for fault in ("memory", "memory_of_c", "address_space"):
        assert table.loc[fault, "status"] == "failed"
        assert table.loc[fault, "reason"].startswith("memory: the trial needed more than its limit")
    assert table.loc["none", "status"] == "done"


@pytest.mark.parametrize("limit", ["1", "30"])
def test_no_limit_is_so_small_that_a_sweep_hangs_or_ends(plugin, tmp_path, limit):
    table = swept(plugin, tmp_path / "r", "seed=range(0,2)", "--memory", limit)
    assert len(table) == 2
    assert set(table["status"]) <= {"failed", "done"}
    failed = table[table["status"] == "failed"]
    assert all("memory" in reason for reason in failed["reason"])
    assert limit == "30" or len(failed)


def test_a_worker_that_falls_silent_is_ended(plugin, tmp_path):
    arguments = ("index.fault=deadlock,none", "engine.silence_s=4", "search.time_limit_s=1")
    table = swept(plugin, tmp_path / "r", *arguments).set_index("index.fault")
    assert table.loc["deadlock", "status"] == "timeout"
    assert "no sign of life for 5 s" in table.loc["deadlock", "reason"]
    assert table.loc["none", "status"] == "done"
    stuck = table.loc["deadlock", "trial_id"]
    assert "planted.py" in (tmp_path / "r" / stuck / "error.txt").read_text()
