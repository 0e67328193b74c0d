"""Postures of the whole hand: found when they exist, refused with the reason when not."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.errors import HandError
from graspbench.hand import GraspChecker


def ring(radius, count, height, turn=0.3):
    angle = turn + 2 * np.pi * np.arange(count) / count
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return radius * normals + (0.1, -0.05, height), normals


def cylinder(radius, height):
    mesh = trimesh.creation.cylinder(radius=radius, height=height, sections=96)
    mesh.apply_translation((0.1, -0.05, height / 2))
    points = mesh.subdivide_to_size(0.008).vertices
    return mesh, np.asarray(points)


@pytest.mark.parametrize("fingers", [3, 4, 5])
def test_a_bottle_is_held_around_its_middle(hand_named, fingers):
    checker = GraspChecker(hand_named("radial", fingers=fingers))
    mesh, surface = cylinder(0.03, 0.15)
    checker.set_object(surface)
    points, normals = ring(0.03, fingers, 0.075)
    posture = checker.place(points, normals)
    assert posture is not None
    assert posture.transform_palm_to_world[2, 2] < -0.9
    assert checker.verify(posture, points, normals, mesh) == ()
    assert checker.reason(points, normals) == ""


@pytest.mark.parametrize("name", ["allegro", "allegro_left"])
def test_allegro_holds_a_can_with_three_fingers(hand_named, name):
    checker = GraspChecker(hand_named(name, fingers=3))
    mesh, surface = cylinder(0.033, 0.09)
    checker.set_object(surface)
    for turn in (0.0, 0.7, 1.4):
        points, normals = ring(0.033, 3, 0.05, turn)
        posture = checker.place(points, normals)
        assert posture is not None
        assert checker.verify(posture, points, normals, mesh) == ()


def test_allegro_holds_a_can_with_four_fingers(allegro):
    checker = GraspChecker(allegro)
    mesh, surface = cylinder(0.033, 0.09)
    checker.set_object(surface)
    angles = np.radians([180.0, -60.0, 0.0, 60.0])
    normals = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = 0.033 * normals + (0.1, -0.05, 0.05)
    posture = checker.place(points, normals)
    assert posture is not None
    assert posture.fingers[0] == allegro.finger_names.index("thumb")
    assert checker.verify(posture, points, normals, mesh) == ()


@settings(max_examples=12, deadline=None)
@given(
    radius=st.floats(0.018, 0.05),
    turn=st.floats(0.0, 2.1),
    tilt=st.floats(-0.3, 0.3),
    fingers=st.sampled_from([3, 4, 5]),
)
def test_spheres_on_the_table_are_grasped_and_every_posture_verified(hand_named, radius, turn, tilt, fingers):
    checker = GraspChecker(hand_named("radial", fingers=fingers))
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    c, s = np.cos(tilt), np.sin(tilt)
    _, flat = ring(1.0, fingers, 0.0, turn)
    normals = flat @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
    centre = np.array([0.0, 0.0, radius + 0.02])
    mesh.apply_translation(centre)
    checker.set_object(np.asarray(mesh.vertices))
    posture = checker.place(centre + radius * normals, normals)
    assert posture is not None
    assert checker.verify(posture, centre + radius * normals, normals, mesh) == ()


def test_numbers_of_the_posture_are_true(hand):
    checker = GraspChecker(hand)
    points, normals = ring(0.03, 3, 0.06)
    posture = checker.place(points, normals)
    assert posture is not None
    pose = posture.transform_palm_to_world
    tips = hand.tip_positions(posture.joints)[list(posture.fingers)] @ pose[:3, :3].T + pose[:3, 3]
    np.testing.assert_allclose(tips, points + hand.tip_radius_m * normals, atol=1e-6)
    share = np.minimum(posture.joints - hand.lower, hand.upper - posture.joints) / (hand.upper - hand.lower)
    used = np.concatenate([hand.finger_joints(f) for f in posture.fingers])
    assert posture.joint_margin == pytest.approx(share[used].min())
    assert posture.joint_margin >= hand.margins.joint
    assert posture.smallest_singular_value >= hand.margins.singular_value_m
    assert posture.clearance_m >= min(hand.margins.hand_m, hand.margins.ground_m)
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)


def test_a_warm_start_stays_near(hand):
    checker = GraspChecker(hand)
    points, normals = ring(0.03, 3, 0.06)
    first = checker.place(points, normals)
    assert first is not None
    shifted = points + np.array([0.002, -0.001, 0.001])
    moved = checker.place(shifted, normals, start=first)
    assert moved is not None
    assert moved.fingers == first.fingers
    assert np.abs(moved.joints - first.joints).max() < 0.2
    assert checker.verify(moved, shifted, normals) == ()


def test_the_answer_does_not_depend_on_what_was_asked_before(radial):
    points, normals = ring(0.04, 3, 0.05)
    first = GraspChecker(radial).place(points, normals)
    other = GraspChecker(radial)
    other.place(*ring(0.02, 3, 0.04, 1.0))
    second = other.place(points, normals)
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.joints, second.joints)
    np.testing.assert_array_equal(first.transform_palm_to_world, second.transform_palm_to_world)


def test_fewer_contacts_than_fingers_leave_fingers_at_rest(hand_named):
    hand = hand_named("radial", fingers=5)
    checker = GraspChecker(hand)
    points, normals = ring(0.03, 2, 0.06)
    posture = checker.place(points, normals)
    assert posture is not None
    idle = [f for f in range(5) if f not in posture.fingers]
    for f in idle:
        np.testing.assert_array_equal(posture.joints[hand.finger_joints(f)], hand.rest[hand.finger_joints(f)])
    assert checker.verify(posture, points, normals) == ()


def test_reasons(radial, allegro):
    checker = GraspChecker(radial)
    assert "ground" in checker.reason(*ring(0.03, 3, 0.004))
    assert checker.place(*ring(0.03, 3, 0.004)) is None
    assert "too wide for the hand" in checker.reason(*ring(0.5, 3, 0.05))
    # 4 fingers that Allegro's thumb and neighbours cannot spread evenly around a thick post.
    wide = GraspChecker(allegro)
    points, normals = ring(0.05, 4, 0.06)
    assert wide.place(points, normals) is None
    assert wide.reason(points, normals)
    with pytest.raises(HandError, match="4 contacts for the 3 fingers"):
        checker.place(points, normals)


def test_a_palm_in_the_way_is_said(radial):
    checker = GraspChecker(radial)
    mesh, surface = cylinder(0.03, 0.5)
    checker.set_object(surface)
    points, normals = ring(0.03, 3, 0.25)
    posture = checker.place(points, normals)
    # Above a pole of 25 cm the palm cannot be; from the side the hand may still do it.
    if posture is None:
        assert checker.reason(points, normals)
    else:
        assert posture.transform_palm_to_world[2, 2] > -0.9
        assert checker.verify(posture, points, normals, mesh) == ()


def test_vertex_mask_is_necessary(radial):
    checker = GraspChecker(radial)
    heights = np.linspace(0.0, 0.03, 31)
    for height in heights:
        points, normals = ring(0.03, 3, height)
        if not checker.vertex_mask(points, normals).all():
            assert height < radial.tip_radius_m + radial.margins.ground_m
            assert checker.place(points, normals) is None
    assert GraspChecker(radial, None).vertex_mask(*ring(0.03, 3, -1.0)).all()


def test_pair_limit_bounds_every_pair_of_tips(hand):
    rng = np.random.default_rng(5)
    limit = GraspChecker(hand).pair_limit_m - 2 * hand.tip_radius_m
    widest = 0.0
    for _ in range(500):
        joints = np.where(rng.random(hand.n_joints) < 0.5, hand.lower, hand.upper)
        joints = np.where(rng.random(hand.n_joints) < 0.3, rng.uniform(hand.lower, hand.upper), joints)
        tips = hand.tip_positions(joints)
        widest = max(widest, np.linalg.norm(tips[:, None] - tips[None], axis=2).max())
    assert widest <= limit
    assert limit < 1.5 * widest


@pytest.mark.parametrize(("depth", "free"), [(-1e-3, True), (-1e-5, True), (1e-4, False), (3e-3, False)])
def test_a_tip_must_not_sink_into_the_object_beside_its_contact(radial, depth, free):
    checker = GraspChecker(radial, None)
    points, normals = np.array([[0.03, 0.0, 0.05], [-0.03, 0.0, 0.05]]), np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    aside = np.array([0.6, 0.8, 0.0])
    wall = points[0] + radial.tip_radius_m * normals[0] + (radial.tip_radius_m - depth) * aside
    checker.set_object(np.vstack((points, wall)))
    np.testing.assert_array_equal(checker.vertex_mask(points, normals), [free, True])
    if not free:
        assert checker.place(points, normals) is None
        assert "sink into the object" in checker.reason(points, normals)


def test_contacts_that_had_no_posture_are_searched_for_once_for_each_object(radial, monkeypatch):
    checker = GraspChecker(radial, 0.0)
    searched = []
    anywhere = checker._search.anywhere
    monkeypatch.setattr(
        checker._search,
        "anywhere",
        lambda task, *more: searched.append(task.points.tobytes()) or anywhere(task, *more),
    )
    normals = np.array([[1.0, 0.0, 0.0], [-0.5, 0.8660254, 0.0], [-0.5, -0.8660254, 0.0]])
    sets = [radius * normals + [0.0, 0.0, 0.06] for radius in (0.4, 0.5)]  # out of reach
    for points in (*sets, *sets):
        assert checker.place(points, normals) is None
        assert checker.reason(points, normals) != ""
    assert len(searched) == len(set(searched)) == 2
    checker.set_object(sets[0])
    assert checker.place(sets[1], normals) is None
    assert len(searched) == 3


def test_the_reason_of_a_failure_is_that_of_the_object_set_last(radial):
    checker = GraspChecker(radial, 0.0)
    points = np.array([[0.03, 0.0, 0.06], [-0.015, 0.026, 0.06], [-0.015, -0.026, 0.06]])
    normals = (points - points.mean(axis=0)) / 0.03
    assert checker.place(points, normals) is not None
    ball = np.random.default_rng(0).standard_normal((4000, 3))
    checker.set_object(points.mean(axis=0) + 0.15 * ball / np.linalg.norm(ball, axis=1)[:, None])
    assert checker.place(points, normals) is None
    assert checker.reason(points, normals) != ""
    checker.set_object(None)
    assert checker.reason(points, normals) == ""
