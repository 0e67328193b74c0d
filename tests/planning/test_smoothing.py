import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.planning.smoothing import _stiffened, low_pass, smooth_way, turning_deg


def configurations(points):
    """One finger's way as shape (n, 1, 3), with normals that turn a little."""
    points = np.asarray(points, dtype=float)[:, None]
    turn = np.linspace(0.0, 0.3, len(points))
    normals = np.stack([np.cos(turn), np.sin(turn), np.zeros(len(points))], axis=1)[:, None]
    return points, normals


def zigzag(back=0.004, step=0.006, count=12):
    along = np.cumsum([step if k % 2 else -back for k in range(count)])
    return np.column_stack([along, 0.001 * np.arange(count) % 2, np.zeros(count)])


def test_low_pass_knows_only_what_came_before():
    values = np.array([0.0, 1.0, 1.0, 5.0])
    np.testing.assert_allclose(low_pass(values, 0.5), [0.0, 0.5, 0.75, 2.875])
    np.testing.assert_allclose(low_pass(values[:3], 0.5), low_pass(values, 0.5)[:3])
    np.testing.assert_allclose(low_pass(values, 1.0), values)


def test_turning_of_known_ways():
    straight = np.linspace([0, 0, 0], [0.1, 0, 0], 30)
    assert turning_deg(straight) == pytest.approx((0.0, 0.0), abs=1e-4)
    angle = np.linspace(0.0, np.pi / 2, 400)
    quarter = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert turning_deg(quarter)[0] == pytest.approx(90.0, abs=3.0)
    there_and_back = np.array([[0, 0, 0], [0.05, 0, 0], [0.0, 0, 0]])
    assert turning_deg(there_and_back)[1] == pytest.approx(180.0, abs=1e-3)


def test_takes_out_loops_and_back_steps():
    points, normals = configurations(zigzag())
    assert turning_deg(points[:, 0])[1] > 120
    way, directions = smooth_way(points, normals, 90.0, 0.02)
    total, sharpest = turning_deg(way[:, 0])
    assert total <= 90
    assert sharpest <= 90
    np.testing.assert_allclose(way[[0, -1]], points[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0)
    np.testing.assert_allclose(directions[-1], normals[-1], atol=1e-12)


def test_a_way_that_is_smooth_already_stays_as_it_is():
    angle = np.linspace(0.0, 1.0, 40)
    points, normals = configurations(0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]))
    way, _ = smooth_way(points, normals, 90.0, 0.02)
    assert np.linalg.norm(way[:, None, 0] - points[None, :, 0], axis=2).min(axis=1).max() < 2e-3
    np.testing.assert_allclose(np.linalg.norm(way[:, 0], axis=1), 0.1, atol=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 40), st.floats(0.002, 0.02))
def test_keeps_the_ends_and_the_distance_asked_for(seed, count, deviation):
    random = np.random.default_rng(seed)
    points = np.cumsum(random.normal(scale=0.004, size=(count, 3, 3)), axis=0)
    normals = random.normal(size=(count, 3, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    way, directions = smooth_way(points, normals, 90.0, deviation)
    np.testing.assert_allclose(way[[0, -1]], points[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(directions[[0, -1]], normals[[0, -1]], atol=1e-6)
    for finger in range(3):
        # From the polygon through the configurations, not only from its corners.
        share = np.linspace(0.0, 1.0, 50)[:, None]
        polygon = (points[:-1, None, finger] * (1 - share) + points[1:, None, finger] * share).reshape(-1, 3)
        apart = np.linalg.norm(way[:, None, finger] - polygon[None], axis=2).min(axis=1)
        assert apart.max() <= deviation + 1e-3


@pytest.mark.parametrize("n", [3, 4, 5, 6, 40])
@pytest.mark.parametrize("stiffness", [0.1, 30.0, 1e5])
def test_the_least_bent_values_are_those_of_the_whole_matrix(n, stiffness):
    values = np.random.default_rng(n).normal(size=(n, 2, 3))
    second = np.diff(np.eye(n), 2, axis=0)
    matrix, flat = np.eye(n) + stiffness * second.T @ second, values.reshape(n, -1)
    wanted = flat.copy()
    wanted[1:-1] = np.linalg.solve(matrix[1:-1, 1:-1], (flat - matrix[:, [0, -1]] @ flat[[0, -1]])[1:-1])
    np.testing.assert_allclose(_stiffened(values, stiffness), wanted.reshape(values.shape), atol=1e-9)
