"""The arm as a mount: its kinematics against PyBullet's, its place, and a grasp carried by it."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pybullet
import pytest
from scipy.spatial.transform import Rotation

from graspbench.config.trial_config import load_config
from graspbench.errors import SimulationError
from graspbench.geometry import ObjectParameters, load_object
from graspbench.grasp.configuration import Grasp
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.arm_parameters import FLOATING, ArmParameters
from graspbench.simulation.grasp_execution import execute_grasp
from graspbench.simulation.mounts.arm_file import PREFIX, read_arm
from graspbench.simulation.mounts.arm_model import ArmModel, brackets
from graspbench.simulation.mounts.choice import make_mount
from graspbench.simulation.phases import palm_task, plan_phases
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction

FRICTION = TipFriction(0.5, 0.002, 0.5)
OBJECT = np.array([0.0, 0.0, 0.05])
PYBULLET = "package://pybullet_data/"
ROBOTS = "package://example-robot-data/robots/"
ARMS = {
    "kuka": load_config(["arm=kuka"]).arm,
    "panda": ArmParameters("panda", PYBULLET + "franka_panda/panda.urdf"),
    "xarm6": ArmParameters("xarm6", PYBULLET + "xarm/xarm6_robot.urdf"),
    "ur5": ArmParameters("ur5", ROBOTS + "ur_description/urdf/ur5_joint_limited_robot.urdf"),
}


@pytest.fixture(scope="module")
def hand():
    return load_hand(HandParameters(fingers=3))


@pytest.fixture(scope="module", params=ARMS)
def arm(hand, request):
    return ArmModel(read_arm(ARMS[request.param]), hand, brackets(from_above())[1])


def from_above(height=0.2):
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = height
    return pose


def from_the_side(height=0.06):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    pose[:3, 3] = [-0.14, 0.0, height]
    return pose


def mount_at(hand, palm, arm=ARMS["kuka"], **changes):
    parameters = ExecutionParameters(**changes)
    task = palm_task(np.array([0.0, 1.0]), np.stack((palm, palm)), OBJECT, parameters, plan_phases)
    return make_mount(arm, hand, task)


def random_joints(arm, count, seed=3):
    shares = np.random.default_rng(seed).uniform(0.2, 0.8, (count, arm.n))
    return [
        joints
        for joints in arm.lower + shares * (arm.upper - arm.lower)
        if arm.assess(joints, np.eye(4)).dexterity > 0.05
    ]


def test_inverse_kinematics_inverts_forward_kinematics(arm):
    rng, tried = np.random.default_rng(3), random_joints(arm, 20)
    assert len(tried) > 5
    for joints in tried:
        pose = arm.palm_pose(joints)
        found = arm.follow(joints + rng.uniform(-0.05, 0.05, arm.n), pose, 0.0, 8)
        np.testing.assert_allclose(arm.palm_pose(found), pose, atol=1e-9)
        assert arm.assess(found, pose).error_m < 1e-8


def test_the_jacobian_is_the_derivative_of_the_palms_pose(arm):
    step = 1e-6
    for joints in random_joints(arm, 5):
        jacobian, pose = arm.jacobian(joints), arm.palm_pose(joints)
        for k in range(arm.n):
            ends = [arm.palm_pose(joints + side * step * np.eye(arm.n)[k]) for side in (-1.0, 1.0)]
            moved = pose[:3, :3].T @ (ends[1][:3, 3] - ends[0][:3, 3]) / (2 * step)
            turned = Rotation.from_matrix(ends[0][:3, :3].T @ ends[1][:3, :3]).as_rotvec() / (2 * step)
            np.testing.assert_allclose(jacobian[:3, k], moved, atol=1e-7)
            np.testing.assert_allclose(jacobian[3:, k], turned, atol=1e-6)


def test_an_arm_reaches_a_pose_from_seeds_of_its_own(arm):
    reached = 0
    tried = random_joints(arm, 10, seed=5)
    for joints in tried:
        pose = arm.palm_pose(joints)
        seeds = arm.seeds(pose, 6)
        assert 1 <= len(seeds) <= 6
        found = [arm.reach(seed, pose) for seed in seeds]
        inside = [q for q in found if np.all((q > arm.lower) & (q < arm.upper))]
        reached += any(np.abs(arm.palm_pose(q) - pose).max() < 1e-6 for q in inside)
        np.testing.assert_array_equal(seeds, arm.seeds(pose, 6))
    assert reached >= 0.8 * len(tried)


def test_no_palm_is_farther_than_the_stretched_arm(arm):
    for joints in random_joints(arm, 200):
        assert np.linalg.norm(arm.palm_pose(joints)[:3, 3] - arm.pivot) <= arm.reach_m + 1e-9


def test_spare_freedom_draws_the_joints_to_the_middle_and_leaves_the_palm(hand):
    arm = ArmModel(read_arm(ARMS["kuka"]), hand, brackets(from_above())[1])
    joints = np.array([1.8, 0.6, -1.5, -1.4, 1.2, 1.0, 0.5])
    pose, now = arm.palm_pose(joints), joints
    for _ in range(200):
        now = arm.follow(now, pose, 0.02)
        np.testing.assert_allclose(arm.palm_pose(now), pose, atol=1e-7)
    assert np.linalg.norm(now) < np.linalg.norm(joints) - 0.05  # the ranges are symmetric


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("palm", [from_above(), from_the_side()])
def test_arm_and_hand_are_one_body_with_the_palm_where_it_is_wanted(hand, palm, name):
    mount = mount_at(hand, palm, ARMS[name], until="contact")
    model = load_object(ObjectParameters(name="cylinder"))
    with World(model, SceneParameters(), 0) as world:
        body = SimulatedHand(world, hand, mount, np.zeros(hand.n_joints), FRICTION)
        np.testing.assert_allclose(body.palm_pose(), palm, atol=1e-6)
        tips = hand.tip_positions(np.zeros(hand.n_joints)) @ palm[:3, :3].T + palm[:3, 3]
        fingers = range(hand.n_fingers)
        np.testing.assert_allclose(body.tip_poses(fingers)[:, :3, 3], tips, atol=1e-5)
        # With a straight bracket the wrist would be in the table when the hand comes from the side.
        names = {}
        for link in range(pybullet.getNumJoints(body.body, physicsClientId=world.client)):
            info = pybullet.getJointInfo(body.body, link, physicsClientId=world.client)
            names[info[12].decode()], names[info[1].decode()] = link, link
        hanging = [names[joint] for joint in mount.placement.arm.arm.joints[3:]]
        for link in hanging:
            assert pybullet.getAABB(body.body, link, physicsClientId=world.client)[0][2] > 0.0
        assert names[mount.placement.arm.arm.tip] >= max(hanging)
        assert all(name.startswith(PREFIX) for name in mount.placement.arm.arm.joints)


@pytest.mark.parametrize("angles", [(20, 30, 40), (0, 90, 30), (50, -90, 0)])
def test_the_hand_is_bolted_on_as_it_is_said(hand, angles):
    kuka = replace(ARMS["kuka"], palm_rpy_deg=angles, palm_xyz_m=(0.01, 0.02, 0.1))
    mount = mount_at(hand, from_above(), kuka, until="contact")
    joint = ElementTree.fromstring(mount.urdf()).find("joint[@name='hand_on_arm']/origin")
    rotation = Rotation.from_euler("xyz", [float(angle) for angle in joint.get("rpy").split()]).as_matrix()
    place = np.array([float(number) for number in joint.get("xyz").split()])
    palm = hand.transform_palm_to_root
    expected = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    np.testing.assert_allclose(rotation @ palm[:3, :3], expected, atol=1e-12)
    np.testing.assert_allclose(rotation @ palm[:3, 3] + place, [0.01, 0.02, 0.145], atol=1e-12)


def test_the_place_is_one_and_the_whole_task_is_within_the_joints_ranges(hand):
    first, second = mount_at(hand, from_above()), mount_at(hand, from_above())
    np.testing.assert_array_equal(first.base_to_world, second.base_to_world)
    place = first.placement
    assert 0.4 < np.linalg.norm(first.base_to_world[:2, 3] - OBJECT[:2]) < 0.8
    now, to_base = place.joints, np.linalg.inv(first.base_to_world)
    plan = plan_phases(from_above(), OBJECT, ExecutionParameters(), place.tilt_direction)
    for phase in plan.motions:
        for share in np.linspace(0.0, 1.0, 50):
            before, goal = now, to_base @ phase.motion(share)
            now = place.arm.follow(now, goal, phase.time_s / 49)
            assert place.arm.assess(now, goal).error_m < 1e-4
            assert np.all((place.arm.lower < now) & (now < place.arm.upper))
            assert share == 0.0 or np.all(np.abs(now - before) < place.arm.speed_limits * phase.time_s / 49)


def test_what_the_arm_cannot_do_is_said(hand):
    with pytest.raises(SimulationError, match="from no place beside the object"):
        mount_at(hand, from_above(2.0))
    mount = mount_at(hand, from_above())
    away = from_above()
    away[0, 3] += 0.05
    with pytest.raises(SimulationError, match=r"joint \d of the arm would have to move at \d+ deg/s"):
        mount.drive(away, 0.002)


def test_a_cylinder_is_carried_as_by_the_floating_wrist(hand):
    model = load_object(ObjectParameters(name="cylinder"))
    grasp, path = planned(hand, model)
    results = {}
    for name, arm in (("floating", FLOATING), ("kuka", ARMS["kuka"]), ("xarm6", ARMS["xarm6"])):
        with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
            parameters = ExecutionParameters(
                squeeze_time_s=0.2, lift_time_s=0.8, hold_time_s=0.1, rotation_deg=40.0
            )
            results[name] = execute_grasp(world, hand, grasp, path, parameters, FRICTION, carrier=arm)
    for result in results.values():
        assert result.success, result.reason
        assert result.palm_error_max_m < 1.2e-3
        assert max(phase.slip_m for phase in result.phases) < 2e-3
    low, high = results["kuka"].motion.transform_palm_to_world[[0, -1], 2, 3]
    assert high > low


def planned(hand, model):
    """Three contacts evenly around the cylinder's middle, and a path that closes onto them."""
    low, high = model.mesh.bounds
    radius, height = 0.5 * (high[0] - low[0]), 0.5 * (high[2] - low[2])
    angles = 2 * np.pi * np.arange(3) / 3
    normals = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(3)))
    points = radius * normals + [0, 0, height]
    posture = GraspChecker(hand, 0.0).place(points, normals)
    assert posture is not None
    palm, opened = posture.transform_palm_to_world, posture.joints.copy()
    for point, normal, finger in zip(points, normals, posture.fingers, strict=True):
        own = hand.finger_joints(finger)
        target = (point + (hand.tip_radius_m + 0.01) * normal - palm[:3, 3]) @ palm[:3, :3]
        opened[own] = hand.finger_ik(finger, target[None], posture.joints[own]).joints[0]
    path = SimpleNamespace(
        times=np.array([0.0, 0.4]),
        joints=np.stack((opened, posture.joints)),
        transform_palm_to_world=np.stack((palm, palm)),
    )
    return Grasp(np.arange(3), points, normals, np.array([0, 0, height]), posture), path
