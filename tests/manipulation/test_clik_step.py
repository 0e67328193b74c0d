import builtins

import numpy as np
import pytest

from graspbench.bench import clik_step as bench
from graspbench.errors import ConfigurationError
from graspbench.manipulation.clik import ClikParameters


def test_rows_name_every_case_and_the_peer_is_optional():
    rows = bench.run(repeats=5, peer=False).rows
    assert [row["case"] for row in rows] == [
        "pseudo_inverse, 3 tasks",
        "pseudo_inverse, no task",
        "transpose, no task",
        "qp, 3 tasks",
    ]
    assert all(row["variables"] == 16 + 4 * 3 for row in rows)
    assert all(0.0 < row["best_us"] <= row["median_us"] for row in rows)


def test_all_three_tasks_are_on_in_the_measured_step():
    law, joints, variables = bench.allegro_case(bench.allegro(), ClikParameters(), bench.SECONDARY_TASKS)
    law.velocity(1.0, joints, variables)
    assert law.system.n_contacts == 4
    assert np.all(law.activations > 0.0)


def test_missing_peer_is_told(monkeypatch):
    original = builtins.__import__

    def without_pink(name, *args, **kwargs):
        if name.partition(".")[0] == "pink":
            raise ImportError(name)
        return original(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_pink)
    with pytest.raises(ConfigurationError, match=r"pip install graspbench\[bench\]"):
        bench.pink_step(bench.allegro())


def test_stability_follows_gain_times_period():
    """Euler's pseudo-inverse loop multiplies the error by 1 - K dt: stable below 2, unstable above."""
    rows = bench.stability(gains=(100.0, 900.0, 1900.0, 2200.0), steps_s=(1e-3,), methods=("pseudo_inverse",))
    assert [row["stable"] for row in rows] == [True, True, True, False]
    for row in rows[:2]:
        expected = row["error_start"] * (1.0 - row["gain_times_step"]) ** 400
        assert row["error_end"] == pytest.approx(expected, abs=1e-9)


def test_transpose_converges_at_moderate_gains():
    rows = bench.stability(gains=(10.0, 100.0), steps_s=(2e-3,), methods=("transpose",))
    assert all(row["stable"] for row in rows)
    assert rows[1]["error_end"] < rows[0]["error_end"]
