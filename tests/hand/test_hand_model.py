"""The hand against Pinocchio, PyBullet and finite differences."""

import numpy as np
import pinocchio
import pybullet
import pytest
from pybullet_utils import bullet_client

from graspbench.hand import HandParameters, list_hands, load_hand


def joints_of(hand, rng):
    return rng.uniform(hand.lower, hand.upper)


def test_all_installed_hands_load(hand_named):
    assert {"radial", "allegro", "allegro_left"} <= set(list_hands())
    for name in list_hands():
        hand = hand_named(name)
        assert hand.n_fingers == len(hand.tip_links) >= 2
        assert len(hand.joint_names) == hand.lower.size == hand.velocity_limits.size


def test_tips_agree_with_pinocchio(hand):
    rng = np.random.default_rng(1)
    palm_from_root = np.linalg.inv(hand.transform_palm_to_root)
    data = hand.model.createData()
    for _ in range(20):
        joints = joints_of(hand, rng)
        pinocchio.framesForwardKinematics(hand.model, data, joints)
        expected = [
            palm_from_root[:3, :3] @ data.oMf[hand.model.getFrameId(link)].translation + palm_from_root[:3, 3]
            for link in hand.tip_links
        ]
        np.testing.assert_allclose(hand.tip_positions(joints), expected, atol=1e-9)


def test_jacobians_agree_with_pinocchio(hand):
    rng = np.random.default_rng(2)
    turn = np.linalg.inv(hand.transform_palm_to_root)[:3, :3]
    data = hand.model.createData()
    joints = joints_of(hand, rng)
    pinocchio.computeJointJacobians(hand.model, data, joints)
    pinocchio.updateFramePlacements(hand.model, data)
    for f, link in enumerate(hand.tip_links):
        frame = hand.model.getFrameId(link)
        expected = (
            turn
            @ pinocchio.getFrameJacobian(
                hand.model, data, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )[:3]
        )
        np.testing.assert_allclose(hand.tip_jacobians(joints)[f], expected, atol=1e-9)


def test_jacobians_are_the_tips_derivatives(hand):
    rng = np.random.default_rng(3)
    joints, step = joints_of(hand, rng), 1e-6
    jacobians = hand.tip_jacobians(joints)
    for j in range(hand.n_joints):
        moved = np.eye(hand.n_joints)[j] * step
        change = (hand.tip_positions(joints + moved) - hand.tip_positions(joints - moved)) / (2 * step)
        np.testing.assert_allclose(jacobians[:, :, j], change, atol=1e-8)


def test_joints_map_to_pybullet_by_name(hand):
    rng = np.random.default_rng(4)
    client = bullet_client.BulletClient(connection_mode=pybullet.DIRECT)
    try:
        for folder in hand.package_dirs:
            client.setAdditionalSearchPath(str(folder))
        body = client.loadURDF(str(hand.urdf_path), useFixedBase=True)
        info = [client.getJointInfo(body, j) for j in range(client.getNumJoints(body))]
        joint_ids = {i[1].decode(): i[0] for i in info}
        link_ids = {i[12].decode(): i[0] for i in info}
        movable = [i[1].decode() for i in info if i[2] == pybullet.JOINT_REVOLUTE]
        assert set(movable) == set(hand.joint_names)
        joints = joints_of(hand, rng)
        for name, angle in zip(hand.joint_names, joints, strict=True):
            client.resetJointState(body, joint_ids[name], angle)
        # The base is placed by its inertial frame, so relative poses are compared.
        inertial = client.getDynamicsInfo(body, -1)
        origin = np.array(client.getBasePositionAndOrientation(body)[0]) - np.array(inertial[3])
        tips = [
            np.array(client.getLinkState(body, link_ids[link], computeForwardKinematics=True)[4])
            for link in hand.tip_links
        ]
        to_root = hand.transform_palm_to_root
        expected = hand.tip_positions(joints) @ to_root[:3, :3].T + to_root[:3, 3]
        np.testing.assert_allclose(np.array(tips) - origin, expected, atol=1e-6)
    finally:
        client.disconnect()


def test_palm_faces_the_fingertips(hand):
    assert np.all(hand.tip_positions(hand.preferred)[:, 2] > 0.05)


def test_left_hand_mirrors_the_right_one(hand_named):
    right, left = hand_named("allegro", fingers=4), hand_named("allegro_left", fingers=4)
    mirrored = right.tip_positions(right.preferred) * (1, -1, 1)
    np.testing.assert_allclose(left.tip_positions(left.preferred), mirrored, atol=1e-6)


def test_radial_fingers_are_turned_copies(hand_named):
    hand = hand_named("radial", fingers=5)
    tips = hand.tip_positions(hand.preferred)
    angle = 2 * np.pi / 5
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(np.roll(tips, -1, axis=0), tips @ turn.T, atol=1e-12)


def test_positive_flexion_curls_inwards(radial):
    for joint in range(1, 4):
        bent = radial.preferred.copy()
        bent[radial.finger_joints(0)[joint]] += 0.1
        before, after = radial.tip_positions(radial.preferred)[0], radial.tip_positions(bent)[0]
        assert np.linalg.norm(after[:2]) < np.linalg.norm(before[:2])


def test_parameters_change_the_hand():
    hand = load_hand(HandParameters(palm_radius_m=0.06, link_lengths_m=(0.08, 0.06, 0.05), tip_radius_m=0.01))
    straight = hand.tip_positions(np.zeros(hand.n_joints))
    np.testing.assert_allclose(straight[0], (0.06, 0.0, 0.19), atol=1e-12)
    assert hand.tip_radius_m == 0.01


def test_same_parameters_give_the_same_hand():
    assert load_hand(HandParameters(fingers=4)) is load_hand(HandParameters(fingers=4))
    assert load_hand(HandParameters(fingers=4)) is not load_hand(HandParameters(fingers=5))


def test_a_chosen_subset_leaves_other_fingers_at_rest(hand_named):
    hand = hand_named("allegro", fingers=3)
    assert hand.finger_names == ("thumb", "index", "ring")
    joints = hand.joint_vector(np.full((3, 4), 0.5))
    idle = [i for i, name in enumerate(hand.joint_names) if name in ("joint_4.0", "joint_5.0", "joint_6.0")]
    np.testing.assert_allclose(joints[idle], hand.rest[idle])
    np.testing.assert_allclose(np.delete(joints, [*idle, hand.joint_names.index("joint_7.0")]), 0.5)


def test_manipulability_is_the_volume_of_the_velocity_ellipsoid(radial):
    singular = np.linalg.svd(radial.tip_jacobians(radial.preferred), compute_uv=False)
    np.testing.assert_allclose(radial.manipulability(radial.preferred), singular.prod(axis=1), rtol=1e-9)


def test_inertias_are_those_of_solids():
    model = load_hand(HandParameters()).model
    for inertia in model.inertias[1:]:
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert inertia.mass > 0
        assert moments[0] > 0
        assert moments[2] <= moments[0] + moments[1] + 1e-15


@pytest.mark.parametrize("name", ["radial", "allegro"])
def test_by_finger_and_joint_vector_are_inverse(hand_named, name):
    hand = hand_named(name, fingers=4)
    joints = np.linspace(0.1, 0.9, hand.n_joints)
    np.testing.assert_array_equal(hand.joint_vector(hand.by_finger(joints)), joints)
