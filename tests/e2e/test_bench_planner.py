"""``graspbench bench planner``, on one object."""

import csv

import cv2
import numpy as np
import pytest

from graspbench.bench.planner import CASES, ceiling
from graspbench.grasp.quality import grasp_quality


@pytest.fixture(scope="module")
def bench(cli, tmp_path_factory):
    output = tmp_path_factory.mktemp("bench") / "deeper"
    return cli("bench", "planner", "--objects", "sphere", "--quick", "--json", "-o", output), output


def test_every_case_has_a_row_and_a_summary(bench):
    finished, output = bench
    assert finished.code == 0, finished.stderr
    rows = finished.document["objects"]
    assert [(row["quality"], row["hand"]) for row in rows] == list(CASES)
    assert all(row["objects"] == "catalogue" and row["contacts"] == 3 for row in rows)
    for row, summary in zip(rows, finished.document["rows"], strict=True):
        assert summary["count"] == 1
        assert summary["without_grasp"] == 0
        assert summary["followed_share"] == pytest.approx(row["followed_share"])
        ratios = [row[f"ratio_q{i}"] for i in (1, 2, 3)]
        if row["quality"] == "thesis":
            # A sphere allows nearly the best of all grasps.
            assert all(0.8 < ratio <= 1.0 + 1e-9 for ratio in ratios)
            assert summary["ratio_mean"] == pytest.approx(np.mean(ratios))
            assert row["q2"] == pytest.approx(row["ratio_q2"] * 1.5)
        else:
            assert ratios == [None, None, None]
            assert summary["ratio_mean"] is None
    with (output / "planner-objects.csv").open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(rows)


def test_quality_over_the_surface_is_in_a_table_and_a_picture(bench):
    finished, output = bench
    steps = [row for row in finished.document["steps"] if row["quality"] == "thesis"]
    assert [row["formed"] for row in steps] == pytest.approx(np.linspace(0, 1, 11))
    assert all(row["p10"] <= row["mean"] + 1e-12 for row in steps)
    assert cv2.imread(finished.document["figures"][0]).shape[1] == 1200
    assert not list(output.glob(".*"))


def test_no_object_is_told(cli, tmp_path):
    finished = cli("bench", "planner", "--objects", ",", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "no object" in finished.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("n_f", [3, 4, 5])
def test_the_ceiling_is_reached_by_equal_angles_in_a_plane_and_exceeded_by_nothing(n_f):
    angles = 2 * np.pi * np.arange(n_f) / n_f
    points = 0.03 * np.column_stack((np.cos(angles), np.sin(angles), 0 * angles))
    model = {"contact": "frictionless", "wrench_space": "planar_force"}
    np.testing.assert_allclose(grasp_quality(points, -points, np.zeros(3), **model), ceiling(n_f), rtol=1e-9)
    rng = np.random.default_rng(n_f)
    some, normals = 0.03 * rng.normal(size=(2, 300, n_f, 3))
    found = np.array(grasp_quality(some, normals, np.zeros(3), **model))
    assert np.all(found <= np.array(ceiling(n_f))[:, None] + 1e-9)
