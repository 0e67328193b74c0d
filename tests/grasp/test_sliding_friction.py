"""Sliding friction against closed forms and against a brute-force search for the most dissipation."""

import numpy as np
import pytest

from graspbench.grasp.sliding_friction import Friction, Sliding, sliding_direction, sliding_friction

MU, E, N = 0.6, 0.004, 5.0


def test_a_point_is_dragged_by_mu_n_whatever_the_speed():
    for speed in (1e-4, 1.0):
        found = sliding_friction(Sliding(speed * np.array([0.6, 0.8])), N, MU)
        np.testing.assert_allclose(found.force, MU * N * np.array([0.6, 0.8]))
        assert found.torque_nm == 0.0


def test_a_pad_that_only_spins_bears_e_n():
    found = sliding_friction(Sliding(np.zeros(2), -3.0), N, MU, E)
    np.testing.assert_array_equal(found.force, 0.0)
    assert found.torque_nm == pytest.approx(-E * N)


def test_it_is_on_the_limit_surface_and_nothing_in_it_dissipates_more():
    rng = np.random.default_rng(0)
    inside = rng.normal(size=(20000, 3))
    inside /= np.linalg.norm(inside, axis=1)[:, None]
    inside *= N * np.array([MU, MU, E])
    for _ in range(20):
        velocity, spin = 0.01 * rng.normal(size=2), rng.normal()
        found = sliding_friction(Sliding(velocity, spin), N, MU, E)
        own = np.array([*found.force, found.torque_nm])
        assert np.linalg.norm(own / [MU, MU, E]) == pytest.approx(N)
        powers = inside @ [*velocity, spin]
        best = own @ [*velocity, spin]
        assert powers.max() <= best + 1e-12
        assert powers.max() > 0.995 * best
        again = sliding_direction(found, MU, E)
        scale = np.linalg.norm(velocity) / np.linalg.norm(again.velocity)
        np.testing.assert_allclose(scale * again.velocity, velocity)
        assert scale * again.spin_rad_s == pytest.approx(spin)


def test_a_spinning_pad_is_pushed_sideways_by_less():
    # Why a drill slides sideways: with |f| small, f = mu^2 N v / (e omega).
    found = sliding_friction(Sliding(np.array([1e-6, 0.0]), 10.0), N, MU, E)
    assert found.force[0] == pytest.approx(MU**2 * N * 1e-6 / (E * 10.0), rel=1e-6)


def test_what_does_not_slide_is_refused():
    with pytest.raises(ValueError, match="slides"):
        sliding_friction(Sliding(np.zeros(2)), N, MU)
    with pytest.raises(ValueError, match="slides"):
        sliding_friction(Sliding(np.zeros(2), 1.0), N, MU)  # a point that spins
    assert sliding_direction(Friction(np.array([1.0, 0.0]), 0.0), MU).spin_rad_s == 0.0
