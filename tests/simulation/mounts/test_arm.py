"""The arm as a mount: its kinematics against PyBullet's, its place, and a grasp carried by it."""

import tempfile
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from itertools import combinations

import numpy as np
import pinocchio
import pybullet
import pytest
from scipy.spatial.transform import Rotation

from graspbench.config.trial_config import load_config
from graspbench.errors import HandError, SimulationError
from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import HandParameters, load_hand
from graspbench.quiet import captured_output
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.arm_parameters import FLOATING, ArmParameters
from graspbench.simulation.grasp_execution import execute_grasp
from graspbench.simulation.mounts.arm_file import PREFIX, read_arm
from graspbench.simulation.mounts.arm_model import FIRST_LOW_JOINT, ArmModel, brackets, carrying_arms
from graspbench.simulation.mounts.arm_placement import place_arm
from graspbench.simulation.mounts.choice import make_mount
from graspbench.simulation.phases import palm_task, plan_phases
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction
from tests.simulation.test_grasp_execution import planned

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
        jacobian = arm.jacobian(joints)
        for k in range(arm.n):
            ends = [arm.palm_pose(joints + side * step * np.eye(arm.n)[k]) for side in (-1.0, 1.0)]
            moved = (ends[1][:3, 3] - ends[0][:3, 3]) / (2 * step)
            turned = Rotation.from_matrix(ends[1][:3, :3] @ ends[0][:3, :3].T).as_rotvec() / (2 * step)
            np.testing.assert_allclose(jacobian[:3, k], moved, atol=1e-7)
            np.testing.assert_allclose(jacobian[3:, k], turned, atol=1e-6)


def test_pose_jacobian_and_singular_value_are_pinocchios(arm):
    """Pinocchio reads the same file by itself, and knows nothing of the compiled chain."""
    model = pinocchio.buildModelFromXML(arm.arm.urdf)
    data, tip = model.createData(), model.getFrameId(arm.arm.tip)
    np.testing.assert_array_equal(
        [model.lowerPositionLimit, model.upperPositionLimit], [arm.lower, arm.upper]
    )
    for joints in random_joints(arm, 20):
        pinocchio.framesForwardKinematics(model, data, joints)
        palm = arm.palm_pose(joints)
        carried = data.oMf[tip].homogeneous @ arm.arm.transform_flange_to_tip @ brackets(from_above())[1]
        np.testing.assert_allclose(palm, carried, atol=1e-12)
        frame = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        at_tip = pinocchio.computeFrameJacobian(model, data, joints, tip, frame)
        way = palm[:3, 3] - data.oMf[tip].translation
        moved = at_tip[:3] + np.cross(at_tip[3:], way, axis=0)
        np.testing.assert_allclose(arm.jacobian(joints), np.vstack((moved, at_tip[3:])), atol=1e-12)
        state = arm.assess(joints, palm)
        values = np.linalg.svd(arm.jacobian(joints), compute_uv=False)
        assert state.dexterity == pytest.approx(values[-1], rel=1e-6)
        lowest = min(
            (data.oMi[k + 1].rotation[2] @ hull.T + data.oMi[k + 1].translation[2]).min(initial=np.inf)
            for k, hull in enumerate(arm.arm.hulls)
            if k >= FIRST_LOW_JOINT
        )
        assert state.lowest_m <= lowest + 1e-12


@pytest.mark.parametrize("turn", [0.0, 1e-12, 0.3, np.pi - 1e-7, np.pi])
@pytest.mark.parametrize("axis", [[1, 0, 0], [0.6, 0, -0.8], [-0.48, 0.6, 0.64]])
def test_what_is_missing_to_a_goal_is_told_for_any_turn(arm, axis, turn):
    joints = 0.6 * arm.lower + 0.4 * arm.upper
    goal = arm.palm_pose(joints)
    goal[:3, :3] = Rotation.from_rotvec(turn * np.array(axis)).as_matrix() @ goal[:3, :3]
    goal[:3, 3] += [0.03, 0.0, 0.04]
    assert arm.assess(joints, goal).error_m == pytest.approx(np.hypot(0.05, turn), abs=1e-6)


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


DEEP_M = 0.002
"""Bullet adds a margin of a millimetre to meshes, and hulls of many corners are thinned out."""


def bullets_hits(mount, path):
    """Return, of each posture, links that overlap in PyBullet's model, which shares only the files."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file, captured_output():
            file.write(mount.urdf())
            file.flush()
            body = pybullet.loadURDF(file.name, useFixedBase=True, physicsClientId=client)
        count = pybullet.getNumJoints(body, physicsClientId=client)
        infos = [pybullet.getJointInfo(body, k, physicsClientId=client) for k in range(count)]
        ids = {info[1].decode(): k for k, info in enumerate(infos)}
        links = {k: info[12].decode() for k, info in enumerate(infos)}
        found = []
        for joints in path:
            for name, angle in zip(mount.placement.arm.arm.joints, joints, strict=True):
                pybullet.resetJointState(body, ids[name], angle, physicsClientId=client)
            found.append(
                {
                    (links[a], links[b])
                    for a, b in combinations(links, 2)
                    if links[a].startswith(PREFIX)
                    and pybullet.getClosestPoints(body, body, -DEEP_M, a, b, physicsClientId=client)
                }
            )
        return found
    finally:
        pybullet.disconnect(client)


@pytest.mark.parametrize("name", ["kuka", "xarm6"])
def test_an_arm_that_hits_itself_or_its_hand_is_told_as_bullet_does(hand, name):
    mount = mount_at(hand, from_above(), ARMS[name], until="contact")
    arm, start = mount.placement.arm, mount.placement.joints
    assert arm.bodies.first_hit(start[None]) is None
    shares = np.random.default_rng(0).uniform(0.02, 0.98, (60, arm.n))
    path = arm.lower + shares * (arm.upper - arm.lower)
    touching, *hits = bullets_hits(mount, [start, *path])
    planted = [joints for joints, hit in zip(path, hits, strict=True) if hit - touching]
    assert planted
    for joints in planted:
        assert arm.bodies.first_hit(joints[None]) is not None
    with pytest.raises(SimulationError, match="would hit each other"):
        mount._check(planted[0], np.zeros(arm.n), arm.palm_pose(planted[0]))


def test_no_place_is_taken_from_which_the_arm_hits_itself(hand):
    """Planted: of two brackets one leads to the better place, until all its postures are said to collide."""
    parameters = ExecutionParameters(until="contact")
    palms = np.stack((from_above(), from_above()))
    task = palm_task(np.array([0.0, 1.0]), palms, OBJECT, parameters, plan_phases)
    arms = carrying_arms(ARMS["xarm6"], hand, task.grasping)
    first = place_arm(arms, task)
    path = first.arm.path(first.joints, np.linalg.inv(first.transform_base_to_world) @ palms, np.arange(2.0))
    np.testing.assert_allclose(path[-1], first.joints, atol=1e-3)
    first.arm.bodies.first_hit = lambda path: ("link 'a'", "link 'b'")
    assert place_arm(arms, task).arm is not first.arm
    for arm in arms:
        arm.bodies.first_hit = lambda path: ("link 'a'", "link 'b'")
    with pytest.raises(SimulationError, match="from no place"):
        place_arm(arms, task)


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


def six_joints(path, count=6, **changes):
    """Write an arm of boxes: joint axes z, y, y, x, y, x, and a flange 50 mm behind the last one."""
    links, joints = ['<link name="foot"/>'], []
    limit = changes.get("limit", '<limit lower="-2.5" upper="2.5" effort="50" velocity="2"/>')
    for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")[:count]):
        parent = f"l{k - 1}" if k else "foot"
        offset = ("0 0 0.2", "0 0 0.1", "0.4 0 0", "0.3 0 0", "0.1 0 0", "0.1 0 0")[k]
        size = "0.1 0.08 0.08" if k == 5 else "0.05 0.05 0.05"
        links.append(
            f'<link name="l{k}"><collision><geometry><box size="{size}"/></geometry></collision></link>'
        )
        joints.append(
            f'<joint name="j{k}" type="{changes.get("kind", "revolute")}"><parent link="{parent}"/>'
            f'<child link="l{k}"/><origin xyz="{offset}"/><axis xyz="{axis}"/>{limit}</joint>'
        )
    extra = changes.get("extra", "")
    path.write_text(f'<robot name="own">{"".join(links + joints)}{extra}</robot>')
    return ArmParameters("own", str(path))


GRIPPER = "".join(
    f'<link name="{name}"/><joint name="to_{name}" type="prismatic"><parent link="l5"/><child link="{name}"/>'
    f'<axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>'
    for name in ("left", "right")
)


@pytest.mark.parametrize("extra", ["", GRIPPER])
def test_chain_tip_and_flange_are_found(tmp_path, extra):
    arm = read_arm(six_joints(tmp_path / "own.urdf", extra=extra))
    assert [joint.removeprefix(PREFIX) for joint in arm.joints] == [f"j{k}" for k in range(6)]
    assert arm.tip == f"{PREFIX}l5"
    np.testing.assert_allclose(arm.transform_flange_to_tip[:3, 3], [0.05, 0, 0], atol=1e-12)
    np.testing.assert_allclose(arm.transform_flange_to_tip[:3, 2], [1, 0, 0], atol=1e-12)
    assert np.linalg.det(arm.transform_flange_to_tip[:3, :3]) == pytest.approx(1.0)
    assert "left" not in arm.urdf


def test_an_arm_of_continuous_joints_turns_once_either_way(tmp_path):
    arm = read_arm(six_joints(tmp_path / "own.urdf", kind="continuous", limit=""))
    model = pinocchio.buildModelFromXML(arm.urdf)
    np.testing.assert_allclose(model.upperPositionLimit, 2 * np.pi)
    np.testing.assert_allclose(arm.speed_limits, np.radians(90.0))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"count": 5}, "has 5 joint\\(s\\) between 'foot' and 'l4'"),
        ({"limit": '<limit lower="1" upper="1"/>'}, "joint 'j0' of arm 'own' has no range"),
        ({"limit": '<limit lower="a" upper="1"/>'}, "joint 'j0' of arm 'own' has 'a' as 'lower'"),
        ({"limit": '<limit lower="0" upper="1"/><mimic joint="j1"/>'}, "follows another"),
        ({"kind": "planar"}, "'j0' of arm 'own' is planar"),
    ],
)
def test_what_is_no_arm_is_said_in_a_sentence(tmp_path, changes, said):
    with pytest.raises(HandError, match=said) as refused:
        read_arm(six_joints(tmp_path / "own.urdf", **changes))
    assert "hand" not in str(refused.value)


def test_names_that_are_not_there_are_said(tmp_path):
    own = six_joints(tmp_path / "own.urdf")
    with pytest.raises(HandError, match="arm 'own' has no link 'hand'"):
        read_arm(replace(own, tip="hand"))
    with pytest.raises(HandError, match=r"arm\.speed_limits_deg has 2 values"):
        read_arm(replace(own, speed_limits_deg=(1.0, 2.0)))
    with pytest.raises(HandError, match=r"the URDF 'no.urdf' of arm 'own' does not exist: correct arm.urdf"):
        read_arm(replace(own, urdf="no.urdf"))
