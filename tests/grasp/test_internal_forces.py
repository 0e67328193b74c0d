"""Grip forces: balanced, in the cones, as deep as can be."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from graspbench.grasp.internal_forces import ForceBalance, friction_reserve, internal_forces


def on_circle(angles, radius=0.03):
    directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
    return radius * directions, -directions


def test_opposite_contacts_need_no_friction():
    points, normals = on_circle(np.array([0.0, np.pi]))
    forces, left = internal_forces(points, normals, 0.5, 4.0)
    np.testing.assert_allclose(forces, 4.0 * normals, atol=0.05)
    assert left > 0.95


def test_three_even_contacts_share_the_force():
    points, normals = on_circle(2 * np.pi * np.arange(3) / 3)
    forces, left = internal_forces(points, normals, 0.5, 4.0)
    np.testing.assert_allclose(forces, 4.0 * normals, atol=0.1)
    assert left > 0.95


def test_what_is_left_of_the_friction_is_the_most_that_balances():
    # Two contacts whose normals lean by 20 degrees from the line between them: tan 20 = 0.364.
    lean = np.radians(20.0)
    points = np.array([[0.03, 0, 0], [-0.03, 0, 0]])
    normals = np.array([[-np.cos(lean), np.sin(lean), 0], [np.cos(lean), np.sin(lean), 0]])
    _, left = internal_forces(points, normals, 0.5, 1.0)
    assert left == pytest.approx(1.0 - np.tan(lean) / 0.5, abs=0.08)
    assert internal_forces(points, normals, 0.25, 1.0)[1] == -1.0


def test_contacts_on_one_side_cannot_balance():
    points, normals = on_circle(np.array([-0.2, 0.0, 0.2]))
    assert internal_forces(points, normals, 0.5, 1.0)[1] == -1.0


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 5))
def test_forces_of_even_grasps_balance_inside_the_cones(seed, n):
    generator = np.random.default_rng(seed)
    points, normals = on_circle(2 * np.pi * np.arange(n) / n + generator.uniform(-0.2, 0.2, n))
    points[:, 2] += generator.uniform(-0.003, 0.003, n)
    turn = Rotation.from_quat(generator.normal(size=4)).as_matrix()
    points, normals = points @ turn.T, normals @ turn.T
    forces, left = internal_forces(points, normals, 0.6, 3.0)
    assert 0.0 <= left <= 1.0
    along = np.einsum("ij,ij->i", forces, normals)
    across = np.linalg.norm(forces - along[:, None] * normals, axis=1)
    assert (along >= 0).all()
    assert (across <= 0.6 * along + 1e-9).all()
    assert (0.6 * along - across >= left * 0.6 * 3.0 * 0.97).all()
    assert along.mean() == pytest.approx(3.0)
    assert np.linalg.norm(forces.sum(axis=0)) < 0.03 * along.sum()
    torque = np.cross(points - points.mean(axis=0), forces).sum(axis=0)
    assert np.linalg.norm(torque) < 0.03 * 0.03 * along.sum()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 1.0))
def test_forces_that_carry_a_weight_add_up_to_it_without_a_moment(seed, weight):
    generator = np.random.default_rng(seed)
    points, normals = on_circle(2 * np.pi * np.arange(3) / 3 + generator.uniform(-0.2, 0.2, 3))
    upwards = generator.normal(size=3)
    upwards *= weight / np.linalg.norm(upwards)
    forces, left = internal_forces(points, normals, 0.6, 3.0, upwards)
    assert left > 0.0
    along = np.einsum("ij,ij->i", forces, normals)
    across = np.linalg.norm(forces - along[:, None] * normals, axis=1)
    assert (0.6 * along - across >= left * 0.6 * 3.0 * 0.97 - 1e-9).all()
    np.testing.assert_allclose(forces.sum(axis=0), upwards, atol=0.03 * along.sum())
    assert np.linalg.norm(np.cross(points, forces).sum(axis=0)) < 0.03 * 0.03 * along.sum()


def test_a_finger_from_above_lets_go_when_the_weight_needs_the_others():
    # Two fingers at the sides can just carry 8 N; the third presses from above.
    points = np.array([[0.05, 0, 0], [-0.05, 0, 0], [0, 0, 0.05]])
    normals = np.array([[-1.0, 0, 0], [1.0, 0, 0], [0, 0, -1.0]])
    idle, _ = internal_forces(points, normals, 0.5, 7.0)
    laden, left = internal_forces(points, normals, 0.5, 7.0, np.array([0.0, 0.0, 8.0]))
    assert left >= 0.0
    assert -laden[2, 2] < 0.6 * -idle[2, 2]


@pytest.mark.parametrize("slope_deg", [0.0, 5.0, 12.0, 20.0])
def test_friction_in_reserve_of_contacts_on_a_cone_is_what_its_slope_leaves(slope_deg):
    # Three contacts around a cone press level: each force leans off its normal by the cone's slope.
    azimuths, slope = np.deg2rad([90.0, 210.0, 330.0]), np.deg2rad(slope_deg)
    out = np.column_stack((np.cos(azimuths), np.sin(azimuths), np.zeros(3)))
    normals = -(np.cos(slope) * out + np.sin(slope) * np.array([0.0, 0.0, 1.0]))
    expected = 1.0 - np.tan(slope) / 0.5
    assert friction_reserve(0.03 * out, normals, 0.5) == pytest.approx(expected, abs=0.06)
    assert friction_reserve(0.03 * out, normals, 0.5, enough=0.1) == pytest.approx(
        min(expected, 0.1), abs=0.02
    )


def test_contacts_that_do_not_balance_have_nothing_in_reserve():
    points = 0.03 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.7, 0.7, 0.0]])
    assert friction_reserve(points, -points / 0.03, 0.5) == -1.0


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-1.0, 1.0))
def test_what_was_left_before_changes_the_way_and_not_the_answer(seed, near):
    generator = np.random.default_rng(seed)
    points, normals = on_circle(2 * np.pi * np.arange(3) / 3 + generator.uniform(-0.7, 0.7, 3))
    balance = ForceBalance(points, normals, generator.uniform(0.1, 0.8))
    weight = generator.normal(size=3)
    forces, left = balance.forces(3.0, weight)
    again, left_again = balance.forces(3.0, weight, near)
    assert left_again == left
    np.testing.assert_array_equal(again, forces)
