"""Motions on a level table against closed forms and against each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspbench.geometry.planar_motion import PlanarMotion

NUMBERS = st.floats(-0.5, 0.5)
MOTIONS = st.builds(
    lambda p, v, w, a, b: PlanarMotion(np.array(p), 1.0, v, w, a, b),
    st.tuples(NUMBERS, NUMBERS, NUMBERS),
    st.tuples(NUMBERS, NUMBERS),
    NUMBERS,
    st.tuples(NUMBERS, NUMBERS),
    st.floats(-0.1, 0.1),
)
TIMES = np.array([-2.0, 0.0, 1.0, 2.5, 7.0])


def test_a_conveyor_shifts_and_does_not_turn():
    motion = PlanarMotion(np.array([0.1, 0.2, 0.03]), 2.0, (0.1, -0.05))
    moved = motion.displacement(5.0)
    np.testing.assert_allclose(moved[:3, :3], np.eye(3), atol=1e-15)
    np.testing.assert_allclose(moved[:3, 3], [0.3, -0.15, 0.0], atol=1e-14)


def test_a_turntable_turns_about_its_axis():
    axis, rate = np.array([0.02, -0.03]), 0.7
    pivot = np.array([0.09, 0.01, 0.04])
    arm = pivot[:2] - axis
    motion = PlanarMotion(pivot, 0.0, (-rate * arm[1], rate * arm[0]), rate)
    for time_s, moved in zip(TIMES, motion.displacements(TIMES), strict=True):
        c, s = np.cos(rate * time_s), np.sin(rate * time_s)
        np.testing.assert_allclose(moved[:2, :2], [[c, -s], [s, c]], atol=1e-12)
        np.testing.assert_allclose(moved[:2, :2] @ axis + moved[:2, 3], axis, atol=1e-12)


@given(MOTIONS)
def test_displacements_are_rigid_level_and_nothing_at_the_reference(motion):
    moved = motion.displacements(TIMES)
    np.testing.assert_allclose(
        moved[:, :3, :3] @ moved[:, :3, :3].transpose(0, 2, 1), [np.eye(3)] * 5, atol=1e-12
    )
    np.testing.assert_allclose(moved[:, 2], [[0.0, 0.0, 1.0, 0.0]] * 5)
    np.testing.assert_allclose(motion.displacement(motion.reference_time_s), np.eye(4), atol=1e-14)


@given(MOTIONS)
def test_the_velocity_is_that_of_the_pivot(motion):
    h = 1e-5
    before, after = motion.places(np.array([1.0 - h, 1.0 + h]))
    np.testing.assert_allclose((after - before)[:2] / (2 * h), motion.velocity_m_s, atol=1e-8)
    assert motion.speed_m_s == pytest.approx(float(np.linalg.norm(motion.velocity_m_s)))


@given(MOTIONS, st.floats(-3.0, 3.0))
def test_another_reference_time_tells_the_same_motion(motion, time_s):
    later = motion.since(time_s)
    through = later.displacements(TIMES) @ motion.displacement(time_s)
    np.testing.assert_allclose(through, motion.displacements(TIMES), atol=1e-9)


@given(MOTIONS, st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_another_pivot_tells_the_same_motion(motion, pivot):
    other = motion.about(np.array(pivot))
    np.testing.assert_allclose(other.displacements(TIMES), motion.displacements(TIMES), atol=1e-9)
