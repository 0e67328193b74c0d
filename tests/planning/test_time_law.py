"""When a motion is where: smooth, and slower only where the joints ask for it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspbench.planning.time_law import minimum_jerk, resampled, slowdown, smooth_durations

STEP = 0.01


@given(st.floats(0, 1))
def test_time_law_is_smooth_at_both_ends(share):
    law = minimum_jerk(np.array([0.0, share, 1.0]))
    assert law[0] == 0.0
    assert law[2] == pytest.approx(1.0)
    assert law[1] == pytest.approx(1.0 - minimum_jerk(np.array([1.0 - share]))[0], abs=1e-12)
    ends = minimum_jerk(np.array([1e-3, 1 - 1e-3]))
    np.testing.assert_allclose(ends, [1e-8, 1 - 1e-8], atol=5e-10)


def test_slowdown_of_a_ramp_is_its_share_of_the_velocity_limit():
    joints = np.outer(STEP * np.arange(50), [1.0, -6.0])
    np.testing.assert_allclose(slowdown(joints, STEP, np.array([2.0, 3.0]), 1e9), 2.0)
    np.testing.assert_allclose(slowdown(joints, STEP, np.array([2.0, 8.0]), 1e9), 1.0)


def test_slowdown_of_a_parabola_is_the_root_of_its_share_of_the_acceleration_limit():
    joints = 0.5 * 90.0 * (STEP * np.arange(20))[:, None] ** 2
    np.testing.assert_allclose(slowdown(joints, STEP, np.array([1e9]), 10.0)[:-1], 3.0)


def test_a_kink_asks_for_slowness_on_both_sides_of_it_and_so_does_a_start_at_speed():
    joints = np.abs(STEP * np.arange(-10.0, 11.0))[:, None]
    slower = slowdown(joints, STEP, np.array([1e9]), 50.0)
    np.testing.assert_allclose(slower[9:11], 2.0)
    np.testing.assert_allclose(slower[[0, -1]], np.sqrt(2.0))
    np.testing.assert_allclose(np.delete(slower, [0, 9, 10, 19]), 1.0)


@given(st.lists(st.floats(1.0, 3.5), min_size=5, max_size=60))
def test_durations_are_smooth_and_long_enough(slower):
    wanted = np.array(slower)
    durations = smooth_durations(wanted, STEP) / STEP
    assert np.all(durations >= wanted - 1e-12)
    assert np.all(durations <= max(1.02 * wanted.max(), 1.0) + 1e-12)
    assert np.abs(np.diff(durations)).max() <= (wanted.max() - 0.9) / 4


def test_resampling_keeps_ends_and_says_when_samples_are_reached():
    line = np.linspace(0.0, 1.0, 11)[None, :, None] * np.ones(3)
    durations = np.full(10, STEP)
    durations[5:] = 3 * STEP
    motion, when = resampled(line, durations, STEP)
    assert motion.shape == (1, 21, 3)
    np.testing.assert_allclose(when, [0, 1, 2, 3, 4, 5, 8, 11, 14, 17, 20])
    np.testing.assert_allclose(motion[0, [0, 5, 20], 0], [0.0, 0.5, 1.0], atol=1e-12)
    np.testing.assert_allclose(motion[0, 8, 0], 0.6, atol=1e-12)
