"""The geometric judge against closed forms."""

import numpy as np
import pytest
import trimesh

from graspbench.config.trial_config import load_config
from graspbench.evaluation.closing import TOUCH_M
from graspbench.evaluation.grasp_record import ContactSet, GraspRecord, HandPose
from graspbench.evaluation.judge import Judge
from graspbench.geometry.model import ObjectModel
from graspbench.grasp import QualityParameters, grasp_quality
from graspbench.grasp.measure import MEASURES
from graspbench.hand import load_hand
from tests.evaluation.scene import known, setting

RADIUS = 0.03


def radial():
    return load_hand(load_config(["record=off", "hand=radial"]).hand)


def ball(radius=RADIUS):
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return ObjectModel("ball", mesh, (mesh,), mass_kg=0.1)


def above_ball(hand, joints=None, height=None):
    """The palm above the ball's centre, its axis pointing down on it."""
    joints = hand.preferred if joints is None else joints
    height = float(hand.tip_positions(hand.preferred)[:, 2].mean()) if height is None else height
    palm = np.diag([1.0, -1.0, -1.0, 1.0])
    palm[2, 3] = height
    return GraspRecord("radial", hand.joint_names, "ball", grasp=HandPose(palm, joints))


def test_a_symmetric_hand_closes_on_a_ball_symmetrically():
    hand = radial()
    record = above_ball(hand)
    judged = Judge(hand, ball()).judge([record])[0]
    assert sorted(judged.fingers) == [0, 1, 2]
    points, normals = judged.contacts.points, judged.contacts.normals
    # The icosphere is inscribed; its faces are at most this far below the sphere.
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), RADIUS, atol=1e-4)
    np.testing.assert_allclose(np.sum(points * normals, axis=1), RADIUS, atol=3e-4)
    np.testing.assert_allclose(np.ptp(points[:, 2]), 0.0, atol=4e-4)
    tips = hand.tip_positions(judged.closed.joints)
    at = tips @ record.grasp.transform_palm_to_object[:3, :3].T + record.grasp.transform_palm_to_object[:3, 3]
    gaps = np.linalg.norm(at, axis=1) - RADIUS - hand.tip_radius_m
    np.testing.assert_allclose(gaps, 0.0, atol=TOUCH_M + 2e-4)
    assert judged.force_closure


def test_measures_are_those_of_the_contacts():
    hand = radial()
    judged = Judge(hand, ball()).judge([above_ball(hand)])[0]
    quality = grasp_quality(
        judged.contacts.points, -judged.contacts.normals, np.zeros(3), torque_length=RADIUS
    )
    assert set(judged.measures) == set(MEASURES)
    assert judged.measures["q3"] == pytest.approx(quality.q3, rel=1e-3)
    assert judged.measures["q1"] == pytest.approx(quality.q1, rel=1e-3)


def test_a_hand_that_cannot_reach_makes_no_contact():
    hand = radial()
    judged = Judge(hand, ball()).judge([above_ball(hand, height=0.5)])[0]
    assert len(judged.contacts.points) == 0
    assert np.isnan(judged.measures["q3"])
    assert not judged.force_closure
    assert judged.depth_m == 0.0


@pytest.mark.parametrize("depth_mm", [0.2, 1.0, 4.0])
def test_depth_is_how_far_a_tip_is_in_the_object(depth_mm):
    hand = radial()
    tip = hand.tip_positions(hand.preferred)[0]
    box = trimesh.creation.box([0.2, 0.2, 0.02])
    model = ObjectModel("slab", box, (box,), mass_kg=0.1)
    palm = np.eye(4)  # the slab is above the fingertips along the palm's axis
    palm[:3, 3] = -tip
    palm[2, 3] -= hand.tip_radius_m + 0.01 - 1e-3 * depth_mm
    pose = HandPose(palm, hand.preferred)
    assert Judge(hand, model).depth_m(pose) == pytest.approx(1e-3 * depth_mm, abs=2e-5)


def test_joints_outside_their_limits_are_named():
    hand = radial()
    joints = hand.preferred.copy()
    joints[1] = hand.upper[1] + 0.1
    judged = Judge(hand, ball()).judge([above_ball(hand, joints)])[0]
    assert f"joint '{hand.joint_names[1]}' is outside its limits" in judged.violations


def test_contacts_alone_are_measured():
    points = RADIUS * np.array([[1.0, 0, 0], [-0.5, 3**0.5 / 2, 0], [-0.5, -(3**0.5) / 2, 0]])
    record = GraspRecord("radial", (), "ball", contacts=ContactSet(points, points / RADIUS))
    quality = QualityParameters(torque_length=RADIUS)
    judged = Judge(radial(), ball(), quality=quality).judge([record])[0]
    # Three hard contacts 120 deg apart on a sphere, moments over r: Q1 = min(sqrt 3, sqrt 1.5).
    assert judged.measures["q1"] == pytest.approx(1.5**0.5)
    assert np.isnan(judged.depth_m)


def test_a_planned_grasp_of_tips_closes_where_it_was_planned():
    context = setting()
    for record, judged in zip(known(), Judge(context.hand, context.object_model).judge(known()), strict=True):
        assert judged.depth_m < 1e-3
        assert judged.violations == ()
        planned = record.contacts.points
        gaps = np.linalg.norm(judged.contacts.points[:, None] - planned, axis=2).min(axis=0)
        assert np.median(gaps) < 3e-3


def test_grasps_do_not_depend_on_their_company():
    context = setting()
    judge = Judge(context.hand, context.object_model)
    alone = judge.judge(known()[1:2])[0]
    together = judge.judge(known())[1]
    np.testing.assert_array_equal(alone.contacts.points, together.contacts.points)
    assert alone.measures == pytest.approx(together.measures, rel=1e-9, nan_ok=True)


def test_shapes_that_are_passed_over_change_nothing(monkeypatch):
    place = setting()
    judge = Judge(place.hand, place.object_model)
    quick = judge.judge(known())
    monkeypatch.setattr("graspbench.evaluation.closing._SURE_M", np.inf)  # each is looked at in each step
    for mine, careful in zip(quick, judge.judge(known()), strict=True):
        assert mine.fingers == careful.fingers
        assert np.array_equal(mine.closed.joints, careful.closed.joints)
        assert np.array_equal(mine.contacts.points, careful.contacts.points)
        assert np.array_equal(mine.contacts.normals, careful.contacts.normals)
