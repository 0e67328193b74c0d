import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.planning.grip_plane import fit_plane, grip_geometry

STARS = st.integers(3, 5)


def star(n_f, radius=0.04, angles=None):
    angles = 2 * np.pi * np.arange(n_f) / n_f if angles is None else np.asarray(angles)
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n_f)])


def test_least_squares_plane_equals_svd():
    rng = np.random.default_rng(1)
    for n_f in (3, 4, 5):
        for _ in range(50):
            points = rng.normal(size=(n_f, 3))
            normal, mean = fit_plane(points, np.zeros(3))
            expected = np.linalg.svd(points - points.mean(axis=0))[2][2]
            assert abs(normal @ expected) == pytest.approx(1.0, abs=1e-9)
            np.testing.assert_allclose(mean, points.mean(axis=0), atol=1e-15)


@given(n_f=STARS)
def test_contacts_are_counter_clockwise_about_the_normal(n_f):
    points = star(n_f)
    np.testing.assert_allclose(fit_plane(points, np.zeros(3))[0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(fit_plane(points[::-1].copy(), np.zeros(3))[0], [0, 0, -1], atol=1e-12)


def test_plane_of_two_contacts_holds_the_centroid():
    points = np.array([[0.1, 0.02, 0.0], [-0.1, 0.01, 0.03]])
    centroid = np.array([0.0, -0.04, 0.02])
    normal, mean = fit_plane(points, centroid)
    np.testing.assert_allclose([(points[0] - mean) @ normal, (centroid - mean) @ normal], 0.0, atol=1e-15)


def test_plane_of_two_contacts_in_line_with_the_centroid_is_some_plane_through_them():
    points = np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]])
    normal, _ = fit_plane(points, np.zeros(3))
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert normal[0] == pytest.approx(0.0)


def test_geometry_of_a_known_grasp():
    points = star(3, 0.04, np.deg2rad([0.0, 100.0, 240.0])) + np.array([0, 0, 0.01])
    found = grip_geometry(points, np.array([0.0, 0.0, 0.003]))
    np.testing.assert_allclose(found.angles_deg, [100, 140, 120], atol=1e-9)
    assert found.equilateral_error_deg == pytest.approx(20.0)
    assert found.plane_offset_m == pytest.approx(0.007)
    assert found.flatness_m == pytest.approx(0.0, abs=1e-12)
    expected = 0.5 * 0.04**2 * sum(np.sin(np.deg2rad([100, 140, 120])))
    assert found.area_m2 == pytest.approx(expected)


@settings(max_examples=30)
@given(n_f=STARS, seed=st.integers(0, 10**6))
def test_geometry_does_not_change_with_a_rigid_motion(n_f, seed):
    rng = np.random.default_rng(seed)
    points, centroid = star(n_f) + 0.003 * rng.normal(size=(n_f, 3)), 0.01 * rng.normal(size=3)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    shift = rng.normal(size=3)
    one, two = grip_geometry(points, centroid), grip_geometry(points @ q.T + shift, q @ centroid + shift)
    np.testing.assert_allclose(one.angles_deg, two.angles_deg, atol=1e-7)
    assert one.area_m2 == pytest.approx(two.area_m2, rel=1e-7)
    assert one.plane_offset_m == pytest.approx(two.plane_offset_m, abs=1e-9)
    assert one.flatness_m == pytest.approx(two.flatness_m, abs=1e-9)
