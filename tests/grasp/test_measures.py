"""The registered measures: closed forms, and measures of other distributions."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

from graspbench import registry
from graspbench.errors import ConfigurationError
from graspbench.grasp import QualityParameters
from graspbench.grasp.measure import MEASURES, describe_measures, evaluate_measures
from graspbench.registry import Registry

CENTRE = np.zeros(3)


def _polygon(count, radius=1.0):
    angles = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])


def _value(name, points, centre=CENTRE, normals=None, **quality):
    inward = -points if normals is None else normals
    found = evaluate_measures([name], points, inward, centre, QualityParameters(**quality), 1.0)
    return float(found[name])


def test_every_measure_says_what_it_is():
    rows = {row["name"]: row for row in describe_measures()}
    assert {"q1", "q2", "q3", "isotropy", "polygon_area", "polygon_irregularity"} <= set(rows)
    assert {"centre_distance", "hull_volume", "min_weight", "task_ellipsoid"} <= set(rows)
    assert all(text for row in rows.values() for text in row.values())


def test_polygons():
    assert _value("polygon_area", _polygon(4, 2.0)) == pytest.approx(8.0)
    assert _value("polygon_area", _polygon(3)[[1, 0, 2]]) == pytest.approx(0.75 * np.sqrt(3.0))
    assert _value("polygon_irregularity", _polygon(5)) == pytest.approx(0.0, abs=1e-12)
    flat = np.array([[-1.0, 0.0, 0.0], [0.0, 1e-7, 0.0], [1.0, 0.0, 0.0]])
    inward = np.tile([0.0, 1.0, 0.0], (3, 1))
    assert _value("polygon_irregularity", flat, normals=inward) == pytest.approx(1.0, abs=1e-6)
    right = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    # angles 90, 45, 45 against 60 each, of at most 60 + 60 + 120
    assert _value("polygon_irregularity", right, normals=inward) == pytest.approx(60.0 / 240.0)
    assert _value("centre_distance", _polygon(3), np.array([0.0, 0.0, 0.4])) == pytest.approx(0.4)


def test_isotropy_of_three_contacts_round_a_ball():
    points = _polygon(3)
    values = evaluate_measures(["q1", "isotropy"], points, -points, CENTRE, QualityParameters(), 1.0)
    assert values["q1"] == pytest.approx(np.sqrt(1.5))
    assert values["isotropy"] == pytest.approx(np.sqrt(1.5 / 3.0))


def test_frictionless_triangle_of_forces():
    model = {"contact": "frictionless", "wrench_space": "planar_force"}
    points = _polygon(3)
    assert _value("q3", points, **model) == pytest.approx(0.5)
    assert _value("task_ellipsoid", points, **model) == pytest.approx(0.5)
    assert _value("hull_volume", points, **model) == pytest.approx(0.75 * np.sqrt(3.0))
    assert _value("min_weight", points, **model) == pytest.approx(1.0 / 3.0)


def test_task_ellipsoid_is_the_ball_with_moments_as_strong_as_forces():
    points = _polygon(3)
    ball = _value("q3", points)
    assert _value("task_ellipsoid", points, task_moment=1.0) == pytest.approx(ball, abs=1e-9)
    weak, strong = (_value("task_ellipsoid", points, task_moment=moment) for moment in (0.1, 10.0))
    assert weak > ball > strong > 0.0


def test_no_closure_is_worth_nothing():
    points, along = _polygon(3), np.tile([0.0, 0.0, 1.0], (3, 1))
    for name in ("q3", "hull_volume", "min_weight", "task_ellipsoid"):
        assert _value(name, points, normals=along) == 0.0


def test_batches_equal_single_grasps():
    rng = np.random.default_rng(5)
    points = rng.standard_normal((4, 3, 3))
    normals = -points + 0.2 * rng.standard_normal(points.shape)
    names, quality = MEASURES.names(), QualityParameters()
    batch = evaluate_measures(names, points, normals, CENTRE, quality, 1.5)
    for k in range(len(points)):
        one = evaluate_measures(names, points[k], normals[k], CENTRE, quality, 1.5)
        for name in names:
            assert one[name] == pytest.approx(batch[name][k], abs=1e-10), name


def test_unknown_measure_is_refused():
    with pytest.raises(ConfigurationError, match=r"unknown measure 'q9'.*isotropy"):
        _value("q9", _polygon(3))


def test_another_distribution_may_register_a_measure(monkeypatch):
    point = EntryPoint("theirs", "graspbench.grasp.measures.polygon:polygon_area", "graspbench.measure")
    monkeypatch.setattr(registry, "entry_points", lambda group: [point] if group == point.group else [])
    fresh = Registry("measure", "graspbench.grasp.measures")
    assert "theirs" in fresh.names()
    assert fresh["theirs"].evaluate is MEASURES["polygon_area"].evaluate
