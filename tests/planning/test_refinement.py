from itertools import combinations

import numpy as np
import pytest

from graspbench.errors import ConfigurationError, PlanningError
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters, grasp_quality
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.planning import RefineParameters, refine
from graspbench.planning.merit import quality_of
from tests.planning.shapes import ellipsoid, lifted

QUALITY = QualityParameters()
COARSE = ellipsoid((0.03, 0.036, 0.05), meridians=7, parallels=5)
FINE = lifted(ellipsoid((0.03, 0.036, 0.05), meridians=24, parallels=23), 0.06)


def grasp_on(surface, rays, posture=None):
    arms = surface.points - surface.centroid
    arms = arms / np.linalg.norm(arms, axis=1, keepdims=True)
    nodes = np.argmax(arms @ np.array(rays, dtype=float).T, axis=0)
    return Grasp(nodes, surface.points[nodes], surface.normals[nodes], surface.centroid, posture)


def tripod(surface, turn_deg=0.0, height=0.1):
    angles = np.deg2rad(turn_deg + np.array([0.0, 120.0, 240.0]))
    return grasp_on(surface, np.column_stack([np.cos(angles), np.sin(angles), np.full(3, height)]))


def measured(surface, nodes):
    length = QUALITY.torque_length_m(surface.points, surface.centroid)
    return quality_of(surface, nodes, QUALITY, length)


@pytest.fixture(scope="module")
def every_quality():
    every = np.array(list(combinations(range(len(COARSE.points)), 3)))
    length = QUALITY.torque_length_m(COARSE.points, COARSE.centroid)
    return grasp_quality(COARSE.points[every], -COARSE.normals[every], COARSE.centroid, torque_length=length)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_reaches_the_best_of_all_grasps_on_a_small_surface(measure, every_quality):
    start = tripod(COARSE)
    found = refine(start, COARSE, measure, QUALITY, parameters=RefineParameters(jumps=12))
    best = getattr(every_quality, measure)[every_quality.q3 > 0.0].max()
    assert found.value == pytest.approx(best, rel=0.01)
    assert found.value == pytest.approx(getattr(measured(COARSE, found.grasp.vertices), measure))
    assert found.start_value == pytest.approx(getattr(measured(COARSE, start.vertices), measure))
    assert found.steps > 0


@pytest.fixture(scope="module")
def held():
    checker = GraspChecker(load_hand(HandParameters(fingers=3)))
    start = tripod(FINE)
    posture = checker.place(start.points, start.normals)
    assert posture is not None
    return checker, Grasp(start.vertices, start.points, start.normals, start.centroid, posture)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_keeps_hand_centre_and_force_closure(held, measure):
    checker, start = held
    tolerance = 0.006
    found = refine(
        start,
        FINE,
        measure,
        QUALITY,
        checker=checker,
        centre_tolerance_m=tolerance,
        parameters=RefineParameters(jumps=1),
    )
    assert found.value > 1.02 * found.start_value
    grasp = found.grasp
    np.testing.assert_array_equal(grasp.points, FINE.points[grasp.vertices])
    assert checker.verify(grasp.posture, grasp.points, grasp.normals) == ()
    assert np.linalg.norm(grasp.points.mean(axis=0) - FINE.centroid) <= tolerance
    length = QUALITY.torque_length_m(FINE.points, FINE.centroid)
    assert force_closure(grasp.points, -grasp.normals, FINE.centroid, QUALITY, length)
    assert found.placements > 0


def test_grasp_that_starts_off_the_centre_may_stay_as_far():
    start = tripod(FINE, height=0.6)
    away = np.linalg.norm(start.points.mean(axis=0) - FINE.centroid)
    found = refine(start, FINE, "q1", QUALITY, centre_tolerance_m=1e-3, parameters=RefineParameters(jumps=0))
    offset = np.linalg.norm(found.grasp.points.mean(axis=0) - FINE.centroid)
    assert away > 1e-3
    assert offset <= away * (1 + 1e-6)


def test_jumps_never_lose_and_repeat_themselves():
    start = tripod(FINE, 20.0)
    without = refine(start, FINE, "q1", QUALITY, parameters=RefineParameters(jumps=0))
    one, two = (refine(start, FINE, "q1", QUALITY, parameters=RefineParameters(jumps=3)) for _ in range(2))
    assert one.value >= without.value >= without.start_value
    np.testing.assert_array_equal(one.grasp.vertices, two.grasp.vertices)
    assert (one.evaluated, one.steps) == (two.evaluated, two.steps)


def test_says_what_it_cannot_start_from():
    with pytest.raises(ConfigurationError, match="unknown measure 'q4'"):
        refine(tripod(FINE), FINE, "q4", QUALITY)
    huddled = grasp_on(FINE, [[1, 0, 0], [1, 0.2, 0], [1, 0, 0.2]])
    with pytest.raises(PlanningError, match="not force closure"):
        refine(huddled, FINE, "q1", QUALITY)
