"""Joints that follow others or slide, and fingers that need the wrist to place their tips."""

from dataclasses import replace

import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import FingerDescription, GraspChecker, HandParameters, PalmDescription, load_hand
from graspbench.hand.chains import LOWER, UPPER
from graspbench.hand.placement import settle
from graspbench.hand.reach import pair_limit
from graspbench.hand.task import make_system
from graspbench.simulation import SceneParameters, World
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.hand_comparison import compare_hand
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction
from tests.hand.small_hands import PALM, fingers, one_joint_coupled, parallel_gripper, two_joints, written


def described(path, tips, centre, **changes):
    parameters = HandParameters(
        name="small",
        kind="urdf",
        urdf=str(path),
        fingers=len(tips),
        palm=PalmDescription("palm"),
        chains=tuple(FingerDescription(tip.split("_")[0], tip, centre(k)) for k, tip in enumerate(tips)),
    )
    return load_hand(replace(parameters, **changes))


@pytest.fixture
def gripper(tmp_path):
    path = parallel_gripper(tmp_path / "gripper.urdf")
    return described(
        path,
        ("left_finger", "right_finger"),
        lambda k: ((0.0075, -0.0075)[k], 0.0, 0.0725),
        tip_radius_m=0.008,
    )


@pytest.fixture
def coupled(tmp_path):
    path = written(tmp_path / "coupled.urdf", PALM + fingers(3, one_joint_coupled))
    return described(path, ("f_b", "g_b", "h_b"), lambda k: (0.0, 0.0, 0.045))


@pytest.fixture
def planar(tmp_path):
    path = written(tmp_path / "planar.urdf", PALM + fingers(3, two_joints))
    return described(path, ("f_b", "g_b", "h_b"), lambda k: (0.0, 0.0, 0.045))


HANDS = ("gripper", "coupled", "planar")


@pytest.fixture(params=HANDS)
def hand(request):
    return request.getfixturevalue(request.param)


def test_freedom_is_what_the_joints_give(gripper, coupled, planar):
    assert gripper.freedom.tolist() == [1, 1]
    assert coupled.freedom.tolist() == [1, 1, 1]
    assert planar.freedom.tolist() == [2, 2, 2]
    assert gripper.joint_names == ("left_slide",)
    assert coupled.joint_names == ("f1", "g1", "h1")
    assert all(each.places_by_wrist for each in (gripper, coupled, planar))


def test_tips_are_those_of_pinocchio(hand):
    rng, data = np.random.default_rng(1), hand.model.createData()
    for joints in rng.uniform(hand.lower, hand.upper, (10, hand.n_joints)):
        pinocchio.framesForwardKinematics(hand.model, data, joints)
        wanted = [data.oMf[hand.model.getFrameId(tip)].translation for tip in hand.tip_links]
        np.testing.assert_allclose(hand.tip_positions(joints), wanted, atol=1e-12)


def test_jacobians_are_finite_differences(hand):
    rng, step = np.random.default_rng(2), 1e-6
    joints = rng.uniform(hand.lower, hand.upper)
    jacobians = hand.tip_jacobians(joints)
    for i, unit in enumerate(np.eye(hand.n_joints)):
        moved = hand.tip_positions(joints + step * unit) - hand.tip_positions(joints - step * unit)
        np.testing.assert_allclose(jacobians[:, :, i], moved / (2 * step), atol=1e-8)


def test_rows_by_finger_and_back(hand):
    joints = np.random.default_rng(3).uniform(hand.lower, hand.upper)
    np.testing.assert_allclose(hand.joint_vector(hand.by_finger(joints)), joints, atol=1e-12)


def test_limits_leave_room_for_those_that_follow(coupled):
    for joints in (coupled.lower, coupled.upper):
        following = joints[0] * 0.8 + 0.3
        assert -0.4 - 1e-9 <= following <= 1.4 + 1e-9


def test_the_span_bounds_every_pair_of_tips(hand):
    rng = np.random.default_rng(4)
    for joints in rng.uniform(hand.lower, hand.upper, (200, hand.n_joints)):
        tips = hand.tip_positions(joints)
        widest = np.linalg.norm(tips[:, None] - tips[None], axis=2).max()
        assert widest <= pair_limit(hand)


@pytest.mark.parametrize("name", HANDS)
def test_reachable_contacts_are_placed_and_verified(name, request):
    hand = request.getfixturevalue(name)
    checker = GraspChecker(hand, ground_height_m=None)
    joints = hand.lower + 0.45 * (hand.upper - hand.lower)
    tips = hand.tip_positions(joints)
    away = tips - tips.mean(axis=0)
    normals = away / np.linalg.norm(away, axis=1, keepdims=True)
    points = tips - hand.tip_radius_m * normals
    turn = pinocchio.exp3(np.array([0.3, -2.0, 0.4]))
    points, normals = points @ turn.T + [0.1, 0.2, 0.3], normals @ turn.T
    posture = checker.place(points, normals)
    assert posture is not None, checker.reason(points, normals)
    assert checker.verify(posture, points, normals) == ()
    assert posture.tip_error_m < 1e-6


def test_contacts_out_of_reach_are_refused(gripper):
    checker = GraspChecker(gripper, ground_height_m=None)
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert checker.place(0.07 * normals, normals) is None


def test_the_simulated_hand_is_the_planned_one(hand):
    found = compare_hand(hand)
    assert found.tips_m < 1e-6
    assert found.mass_share < 1e-6
    assert found.shapes[0] == found.shapes[1]
    assert found.sizes_m < 1e-9


def test_joints_follow_in_the_simulation(hand):
    if not hand.followers:
        pytest.skip("nothing follows")
    with World(load_object(ObjectParameters(name="cylinder")), SceneParameters(), 0) as world:
        pose = np.diag([1.0, -1.0, -1.0, 1.0])
        pose[2, 3] = 1.0
        wrist = FloatingWrist(hand, pose, np.array([1.0, 0.0, 0.0]))
        simulated = SimulatedHand(world, hand, wrist, hand.preferred, TipFriction(0.5, 0.0, 0.5))
        goal = hand.lower + 0.8 * (hand.upper - hand.lower)
        for _ in range(400):
            simulated.drive_wrist(pose, 0.001)
            simulated.drive_joints(goal, np.zeros(hand.n_joints))
            pybullet.stepSimulation(physicsClientId=world.client)
        joints, _ = simulated.state()
        np.testing.assert_allclose(joints, goal, atol=5e-3 * np.ptp([hand.lower, hand.upper]))
        tips = simulated.tip_poses(range(hand.n_fingers))[:, :3, 3]
        palm = simulated.palm_pose()
        wanted = hand.tip_positions(joints) @ palm[:3, :3].T + palm[:3, 3]
        np.testing.assert_allclose(tips, wanted, atol=1e-4)


def test_a_search_does_not_run_away_where_fingers_cannot_reach(hand):
    rng, chains = np.random.default_rng(0), hand.chains
    checker, system = GraspChecker(hand), make_system(chains, hand.shapes)
    contact_of = np.arange(hand.n_fingers, dtype=np.int64)
    for _ in range(200):
        points = 0.2 * rng.standard_normal((hand.n_fingers, 3))
        task = checker._task(points, points / np.linalg.norm(points, axis=1, keepdims=True))
        pose = np.c_[Rotation.random(rng=rng).as_matrix(), np.zeros(3)]
        high = rng.random(chains.index.shape) < 0.5
        joints = np.where(high, chains.limits[..., UPPER], chains.limits[..., LOWER])
        left = settle(chains, hand.shapes, task, contact_of, pose, joints, system, 12)
        assert np.isfinite(left)
        assert np.abs(pose[:, 3]).max() < 3.0
