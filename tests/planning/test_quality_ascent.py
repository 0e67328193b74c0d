import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.grasp.quality import QualityParameters, grasp_quality
from graspbench.planning.index import Moves, free_moves
from graspbench.planning.indices.quality_ascent import QualityAscent, QualityAscentParameters
from tests.planning.shapes import radial


def waved(d):
    return 0.04 * (1 + 0.1 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 0])


SURFACE = radial(waved, meridians=24, parallels=17)
ARMS = SURFACE.points - SURFACE.centroid
START = np.argmax(
    ARMS
    / np.linalg.norm(ARMS, axis=1, keepdims=True)
    @ np.array([[1, 0.1, 0.1], [-0.5, 0.9, 0.0], [-0.4, -0.866, -0.1]]).T,
    axis=0,
)


def measure(vertices):
    length = QualityParameters().torque_length_m(SURFACE.points, SURFACE.centroid)
    return grasp_quality(
        SURFACE.points[vertices], -SURFACE.normals[vertices], SURFACE.centroid, torque_length=length
    )


@pytest.mark.parametrize(("name", "pairs"), [("q1", False), ("q2", True), ("q3", False)])
def test_climbs_its_measure_to_a_local_optimum(name, pairs):
    weights = {"weight_q1": 0.0, "weight_q2": 0.0, "weight_q3": 0.0, f"weight_{name}": 1.0}
    index = QualityAscent(QualityAscentParameters(**weights, pairs=pairs), 3)
    assert measure(START).q3 > 0
    vertices, values = START, [getattr(measure(START), name)]
    while (proposed := index.propose(SURFACE, vertices, free_moves(SURFACE, vertices))) is not None:
        assert np.count_nonzero(proposed != vertices) in ((1, 2) if pairs else (1,))
        vertices = proposed
        values.append(getattr(measure(vertices), name))
    assert len(values) > 1
    assert np.all(np.diff(values) > 0)
    for i in range(3):
        for node in SURFACE.network.contour(int(vertices[i])):
            other = vertices.copy()
            other[i] = node
            if measure(other).q3 > 0:
                assert getattr(measure(other), name) <= values[-1] + 1e-8


def test_weighted_sum():
    parameters = QualityAscentParameters(weight_q1=0.5, weight_q2=0.25, weight_q3=2.0)
    q1, q2, q3 = measure(START)
    assert QualityAscent(parameters, 3).score(SURFACE, START) == pytest.approx(0.5 * q1 + 0.25 * q2 + 2 * q3)


def test_force_closure_comes_before_any_quality():
    one_sided = SURFACE.network.contour(200)[[0, 2, 4]].copy()
    assert measure(one_sided).q3 == 0
    index = QualityAscent(QualityAscentParameters(weight_q2=100.0), 3)
    assert index.score(SURFACE, one_sided) < 0 < index.score(SURFACE, START)


def test_centre_of_grip_stays_near_the_centroid():
    off = np.linalg.norm(SURFACE.points[START].mean(axis=0) - SURFACE.centroid)
    tight = QualityAscent(QualityAscentParameters(centre_tolerance_m=0.5 * off), 3)
    loose = QualityAscent(QualityAscentParameters(centre_tolerance_m=2 * off), 3)
    assert tight.score(SURFACE, START) < 0 < loose.score(SURFACE, START)


def test_unreachable_nodes_are_never_chosen():
    moves = free_moves(SURFACE, START)
    nodes = moves.nodes.copy()
    nodes[1:, 1:] = -1
    index = QualityAscent(QualityAscentParameters(weight_q1=1.0), 3)
    proposed = index.propose(SURFACE, START, Moves(nodes, moves.barrier, moves.barrier_force))
    assert proposed is None or np.array_equal(proposed[1:], START[1:])


def test_needs_a_weight():
    with pytest.raises(ConfigurationError, match="all weights"):
        QualityAscent(QualityAscentParameters(weight_q3=0.0), 3)


def test_of_two_grasps_off_the_centroid_the_nearer_one_is_preferred():
    """A weight near zero leaves only what being away costs."""
    weights = {"weight_q1": 1e-9, "weight_q2": 0.0, "weight_q3": 0.0}
    index = QualityAscent(QualityAscentParameters(**weights, centre_tolerance_m=1e-6), 3)
    moved = START.copy()
    moved[0] = START[1]
    moved[1] = SURFACE.network.contour(int(START[1]))[0]
    offsets = [np.linalg.norm(SURFACE.points[v].mean(axis=0) - SURFACE.centroid) for v in (START, moved)]
    assert offsets[0] < offsets[1]
    closed = [1e3 * (measure(v).q3 <= 0.0) for v in (START, moved)]
    near, far = (index.score(SURFACE, v) + c for v, c in zip((START, moved), closed, strict=True))
    assert far < near < 0.0
