"""The order of the tests: the files that take longest come first, so that none is left over at the end.

What computes stands beside what mostly waits, for other processes or for time to pass.
"""

from pathlib import Path

import pytest

LONG = (
    "e2e/test_every_value.py",
    "sweep/test_sweep_processes.py",
    "slurm/test_slurm.py",
    "e2e/test_run.py",
    "sweep/test_memory.py",
    "e2e/test_figures_3.py",
    "sweep/test_signals.py",
    "e2e/test_results_tell_the_truth.py",
    "e2e/test_streams_and_disks.py",
    "e2e/test_sweep_and_report.py",
    "docs/test_docs.py",
    "e2e/test_appendix_a.py",
    "sweep/test_fuzz_signals.py",
    "e2e/test_fuzz_results.py",
    "hand/test_hand_files.py",
    "hand/test_grasp_checker.py",
    "e2e/test_bench.py",
    "e2e/test_table_3_1.py",
    "e2e/test_gait.py",
    "e2e/test_arms.py",
    "e2e/test_manipulate.py",
    "config/test_bounds.py",
    "manipulation/test_qp.py",
    "manipulation/test_clik_step.py",
    "simulation/controllers/test_controllers.py",
)
_HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring the long files to the front."""
    rank = {_HERE / name: place for place, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path, len(LONG)))
