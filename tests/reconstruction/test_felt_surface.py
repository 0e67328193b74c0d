"""Surfaces corrected by what was felt, against closed forms and brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.reconstruction import Ellipsoid, Surface, build_network
from graspbench.reconstruction.felt_surface import (
    PoseBelief,
    corrected_surface,
    planar_transform,
    updated_belief,
)
from graspbench.reconstruction.sampling import sample_ellipsoid
from graspbench.reconstruction.snapshot import snapshot

CENTRE = np.array([0.02, -0.01, 0.05])
AXES = np.array([0.045, 0.025, 0.04])
PRIOR = PoseBelief.prior(CENTRE, 4e-3, np.radians(8.0))
SMALL = st.floats(-1.0, 1.0)


def ellipsoid(axes=AXES) -> Surface:
    network = build_network(60, 60)
    return snapshot(sample_ellipsoid(Ellipsoid(CENTRE, np.eye(3), np.asarray(axes)), network, 0.5), network)


def on_ellipsoid(directions, axes=AXES):
    """Return points of the ellipsoid itself, not of its net."""
    units = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return CENTRE + units * axes


SURFACE = ellipsoid()
TOUCHED = np.array([[1, 0.2, 0.1], [0.3, 1, 0.2], [-1, 0.4, 0.0], [0.1, -1, 0.3], [0.8, -0.7, 0.1]])


@settings(max_examples=15, deadline=None)
@given(SMALL, SMALL, SMALL)
def test_five_touches_find_how_an_ellipsoid_lies(x, y, turn):
    truth = np.array([4e-3 * x, 4e-3 * y, np.radians(8.0) * turn])
    pose = planar_transform(CENTRE, truth)
    felt = on_ellipsoid(TOUCHED) @ pose[:3, :3].T + pose[:3, 3]
    found = updated_belief(PRIOR, SURFACE, felt, 0.2e-3)
    np.testing.assert_allclose(found.mean[:2], truth[:2], atol=0.4e-3)
    assert found.mean[2] == pytest.approx(truth[2], abs=np.radians(1.5))


def test_what_was_not_felt_is_believed_as_before():
    found = updated_belief(PRIOR, SURFACE, np.empty((0, 3)), 0.5e-3)
    np.testing.assert_allclose(found.mean, 0.0)
    np.testing.assert_allclose(found.covariance, PRIOR.covariance, rtol=1e-9)


def test_one_touch_of_a_flank_is_the_scalar_kalman_update():
    sigma, noise, offset = 4e-3, 1e-3, 2e-3
    felt = on_ellipsoid(np.array([[1.0, 0.0, 0.0]]))
    felt[0, 0] += offset
    found = updated_belief(PRIOR, SURFACE, felt, noise)
    gain = sigma**2 / (sigma**2 + noise**2)
    assert found.mean[0] == pytest.approx(gain * offset, abs=0.05e-3)
    assert found.covariance[0, 0] == pytest.approx(sigma**2 * (1.0 - gain), rel=0.02)
    assert found.covariance[1, 1] == pytest.approx(sigma**2, rel=0.02)


def test_the_expected_gain_is_by_how_much_the_expected_error_falls():
    contacts = on_ellipsoid(np.array([[1.0, 0.5, 0.0], [-1.0, 0.5, 0.2], [0.0, -1.0, 0.1]]))
    nodes = np.array([100, 800, 1500, 2300, 3000])
    places, normals, noise = SURFACE.points[nodes], SURFACE.normals[nodes], 0.7e-3
    gains = PRIOR.expected_gain_m2(places, normals, contacts, noise)
    for place, normal, gain in zip(places, normals, gains, strict=True):
        j = PRIOR.sensitivity(place[None], normal[None])
        after = np.linalg.inv(np.linalg.inv(PRIOR.covariance) + j.T @ j / noise**2)
        left = PoseBelief(CENTRE, PRIOR.mean, after).expected_square_m2(contacts)
        fallen = PRIOR.expected_square_m2(contacts) - left
        assert gain == pytest.approx(fallen, rel=1e-6)
        assert gain >= 0.0


def test_the_expected_error_is_that_of_drawn_poses():
    contacts = on_ellipsoid(np.array([[1.0, 0.5, 0.0], [-1.0, 0.5, 0.2]]))
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(3), PRIOR.covariance, 4000)
    squares = [
        np.sum((contacts @ pose[:3, :3].T + pose[:3, 3] - contacts) ** 2)
        for pose in (planar_transform(CENTRE, each) for each in drawn)
    ]
    assert PRIOR.expected_square_m2(contacts) == pytest.approx(np.mean(squares), rel=0.05)


def test_a_dent_is_corrected_where_it_was_felt_and_nowhere_else():
    felt = on_ellipsoid(np.array([[1.0, 0.0, 0.0]]))
    felt[0, 0] -= 3e-3
    known = PoseBelief(CENTRE, np.zeros(3), np.zeros((3, 3)))
    made = corrected_surface(SURFACE, known, felt, noise_m=0.1e-3, shape_std_m=2e-3, length_m=10e-3)
    moved = np.linalg.norm(made.points - SURFACE.points, axis=1)
    distance = np.linalg.norm(SURFACE.points - felt, axis=1)
    # One felt value: the kernel itself, scaled.
    expected = 3e-3 * np.exp(-0.5 * distance**2 / 10e-3**2)
    np.testing.assert_allclose(moved, expected, atol=0.25e-3)
    assert moved[distance > 0.05].max() < 1e-5
    assert corrected_surface(
        SURFACE, known, np.empty((0, 3)), noise_m=1e-4, shape_std_m=2e-3, length_m=0.01
    ) is SURFACE  # fmt: skip


@given(SMALL, SMALL, st.floats(-3.0, 3.0))
def test_a_planar_transform_turns_about_its_pivot_and_keeps_heights(x, y, turn):
    pose = planar_transform(CENTRE, np.array([x, y, turn]))
    np.testing.assert_allclose(pose[:3, :3] @ CENTRE + pose[:3, 3], np.add(CENTRE, [x, y, 0.0]), atol=1e-12)
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(pose[2], [0.0, 0.0, 1.0, 0.0], atol=1e-15)
