import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.manipulation import charts
from graspbench.manipulation.compiled.rotations import (
    axis_angle_matrix,
    euler_angles,
    euler_matrix,
    rotation_error,
    rotation_matrix,
)
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem, contact_columns
from graspbench.manipulation.kinematic_tree import planar_tree, tree_from_pinocchio
from tests.manipulation.cases import CHARTS, random_tree, turn_between

STEP = 1e-6
KINDS = ("frictionless", "hard", "soft", "rolling")


def make_system(chart, rng, radius=0.012):
    """One hand with a shared joint and one contact of each type on the same chart."""
    contacts = [Contact(chart, kind, radius) for kind in KINDS]
    return ManipulationSystem(random_tree(rng), contacts)


def random_configuration(system, case, rng):
    _, u, v = case
    variables = rng.uniform(-1.0, 1.0, (system.n_contacts, 5))
    variables[:, 0], variables[:, 1] = rng.uniform(*u, system.n_contacts), rng.uniform(*v, system.n_contacts)
    return rng.uniform(-2.0, 2.0, system.n_joints), variables


def test_extended_fingers_match_central_differences(chart_case):
    """J q' + J_eta eta' = G^T v_o with v_o differenced from the object's pose at the chain's end."""
    rng = np.random.default_rng(0)
    system = make_system(chart_case[0], rng)
    for _ in range(100):
        joints, variables = random_configuration(system, chart_case, rng)
        state = system.state(joints, variables)
        velocity = rng.normal(size=system.n_variables)
        rates = state.rates(velocity)
        jacobian = state.jacobian.copy()
        transposes = [state.grasp_transpose(i) for i in range(4)]
        poses = []
        for sign in (-1, 1):
            state.update(joints + sign * STEP * velocity[: system.n_joints], variables + sign * STEP * rates)
            poses.append((state.object_positions.copy(), state.object_rotations.copy()))
        for i in range(4):
            linear = (poses[1][0][i] - poses[0][0][i]) / (2 * STEP)
            angular = turn_between(poses[0][1][i], poses[1][1][i]) / (2 * STEP)
            twist = np.concatenate([linear, angular])
            expected = transposes[i] @ twist
            assert np.linalg.norm(jacobian[6 * i : 6 * i + 6] @ velocity - expected) <= 1e-6 * np.linalg.norm(
                expected
            )


def test_tip_jacobians_match_central_differences():
    rng = np.random.default_rng(1)
    system = make_system(CHARTS["sphere"][0], rng)
    for _ in range(100):
        joints, variables = random_configuration(system, CHARTS["sphere"], rng)
        state = system.state(joints, variables)
        blocks = state.tip_jacobians.copy()
        direction = rng.normal(size=system.n_joints)
        ends = []
        for sign in (-1, 1):
            state.update(joints + sign * STEP * direction, variables)
            ends.append((state.tip_positions.copy(), state.tip_rotations.copy()))
        for i in range(4):
            linear = (ends[1][0][i] - ends[0][0][i]) / (2 * STEP)
            angular = turn_between(ends[0][1][i], ends[1][1][i]) / (2 * STEP)
            twist = np.concatenate([linear, angular])
            assert np.linalg.norm(blocks[i] @ direction - twist) <= 1e-6 * np.linalg.norm(twist)


def test_contact_jacobian_and_grasp_matrix_match_object_side_differences(chart_case):
    """v_c = G^T v_o + J_xi xi' from the object's side alone, with an independent pose of the contact."""
    chart = chart_case[0]
    rng = np.random.default_rng(2)
    system = make_system(chart, rng, radius=0.0 + 0.01)
    for _ in range(100):
        joints, variables = random_configuration(system, chart_case, rng)
        state = system.state(joints, variables)
        columns = contact_columns(system, 0)  # the frictionless contact: u, v, theta
        position, rotation = state.object_positions[0].copy(), state.object_rotations[0].copy()
        twist, rate = rng.normal(size=6), rng.normal(size=2)
        ends = []
        for sign in (-1, 1):
            at = chart(variables[0, :2] + sign * STEP * rate)
            turned = Rotation.from_rotvec(sign * STEP * twist[3:]).as_matrix() @ rotation
            contact = position + sign * STEP * twist[:3] + turned @ (at.point + 0.01 * at.frame[:, 2])
            ends.append((contact, turned @ at.frame))
        moved = (ends[1][0] - ends[0][0]) / (2 * STEP)
        turned_rate = turn_between(ends[0][1], ends[1][1]) / (2 * STEP)
        expected = np.concatenate([moved, turned_rate])
        j_xi = -state.jacobian[:6, columns[:2]]
        got = state.grasp_transpose(0) @ twist + j_xi @ rate
        assert np.linalg.norm(got - expected) <= 1e-6 * np.linalg.norm(expected)


def test_rolling_tip_does_not_slip(chart_case):
    """Material velocities of tip and object at the contact are equal, in any motion of the chain."""
    rng = np.random.default_rng(3)
    system = make_system(chart_case[0], rng)
    for _ in range(20):
        joints, variables = random_configuration(system, chart_case, rng)
        state = system.state(joints, variables)
        velocity = rng.normal(size=system.n_variables)
        contact_twist = state.jacobian[18:24] @ velocity
        object_twist = np.linalg.solve(state.grasp_transpose(3), contact_twist)
        tip_twist = state.tip_jacobians[3] @ velocity[: system.n_joints]
        normal = state.object_rotations[3] @ state.surface_normals[3]
        at_contact = state.tip_positions[3] - 0.012 * normal
        tip = tip_twist[:3] + np.cross(tip_twist[3:], at_contact - state.tip_positions[3])
        body = object_twist[:3] + np.cross(object_twist[3:], at_contact - state.object_positions[3])
        np.testing.assert_allclose(tip, body, atol=1e-10)


def test_contact_jacobians_have_full_rank_for_every_type(chart_case):
    rng = np.random.default_rng(4)
    system = make_system(chart_case[0], rng)
    state = system.state(*random_configuration(system, chart_case, rng))
    for i, free in enumerate((5, 3, 2, 3)):
        block = state.jacobian[6 * i : 6 * i + 6, contact_columns(system, i)]
        assert block.shape == (6, free)
        assert np.linalg.matrix_rank(block, tol=1e-8) == free


def test_planar_reduction_is_the_spatial_system_restricted():
    tree = planar_tree(np.array([[0.0, 0.0]]), [-1, 0, 1, 1], [0.1] * 4, [2, 3])
    side = charts.plane(rotation=np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]))
    contacts = [Contact(side, "frictionless"), Contact(side, "hard")]
    flat, full = ManipulationSystem(tree, contacts, planar=True), ManipulationSystem(tree, contacts)
    rng = np.random.default_rng(5)
    joints, variables = rng.uniform(-1, 1, 4), np.zeros((2, 5))
    variables[:, 1:3] = rng.uniform(-1, 1, (2, 2))
    assert flat.n_variables == 4 + 2 + 1
    assert flat.rows == 3
    small, large = flat.state(joints, variables).jacobian, full.state(joints, variables).jacobian
    kept_rows = [0, 1, 5, 6, 7, 11]
    kept_columns = [0, 1, 2, 3, full.xi_columns[0, 1], full.theta_columns[0, 0], full.theta_columns[1, 0]]
    np.testing.assert_allclose(small, large[np.ix_(kept_rows, kept_columns)], atol=1e-15)
    lost = np.delete(large, kept_rows, axis=0)[:, kept_columns]
    np.testing.assert_allclose(lost, 0.0, atol=1e-15)


def test_kinematics_agree_with_pinocchio():
    model = pinocchio.buildSampleModelManipulator()
    names = [model.frames[-1].name]
    system = ManipulationSystem(tree_from_pinocchio(model, names), [Contact(charts.plane(), "hard")])
    data = model.createData()
    rng = np.random.default_rng(6)
    for _ in range(20):
        joints = rng.uniform(-1, 1, model.nq)
        state = system.state(joints, np.zeros((1, 5)))
        frame = model.getFrameId(names[0])
        aligned = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        expected = pinocchio.computeFrameJacobian(model, data, joints, frame, aligned)
        np.testing.assert_allclose(state.tip_jacobians[0], expected, atol=1e-12)
        np.testing.assert_allclose(state.tip_positions[0], data.oMf[frame].translation, atol=1e-12)


@pytest.mark.parametrize("align", [True, False])
def test_grasped_reproduces_the_object_pose(align):
    rng = np.random.default_rng(7)
    chart = charts.sphere(0.05)
    system = ManipulationSystem(random_tree(rng, fingers=1), [Contact(chart, "rolling", 0.012)])
    joints = rng.uniform(-1, 1, system.n_joints)
    tip = system.state(joints, np.zeros((1, 5))).tip_positions[0]
    rotation = Rotation.from_rotvec([0.2, 0.4, -0.3]).as_matrix()
    position = tip - rotation @ (0.062 * np.array([np.cos(0.3), np.sin(0.3), 0.0]))
    placed, variables = system.grasped(joints, position, rotation, align=align)
    state = placed.state(joints, variables)
    np.testing.assert_allclose(state.object_positions[0], position, atol=1e-10)
    np.testing.assert_allclose(state.object_rotations[0], rotation, atol=1e-10)
    if align:
        np.testing.assert_array_equal(variables[:, 2:], 0.0)


def test_the_euler_singularity_is_refused():
    rng = np.random.default_rng(8)
    system = ManipulationSystem(random_tree(rng, fingers=1), [Contact(charts.plane(), "hard")])
    with pytest.raises(ManipulationError, match="singularity") as caught:
        system.state(np.zeros(system.n_joints), np.array([[0.0, 0, 0, np.pi / 2, 0]]))
    assert caught.value.data["contact"] == 0


def test_bad_systems_are_refused():
    tree = random_tree(np.random.default_rng(9), fingers=1)
    with pytest.raises(ConfigurationError, match="1 fingertips but 2"):
        ManipulationSystem(tree, [Contact(charts.plane(), "hard")] * 2)
    with pytest.raises(ConfigurationError, match="cannot roll"):
        ManipulationSystem(tree, [Contact(charts.plane(), "rolling")])
    with pytest.raises(ConfigurationError, match="unknown contact type"):
        ManipulationSystem(tree, [Contact(charts.plane(), "glued")])


def test_euler_angles_invert_their_matrix():
    rng = np.random.default_rng(10)
    out = np.empty((3, 3))
    for angles in rng.uniform(-1.5, 1.5, (50, 3)):
        euler_matrix(angles, out)
        np.testing.assert_allclose(out, Rotation.from_euler("XYZ", angles).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(euler_angles(out), angles, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-10, 1e-5, 0.5, 3.0, np.pi - 1e-7, np.pi])
def test_rotation_error_is_the_rotation_left(angle):
    rng = np.random.default_rng(11)
    error, turn = np.empty(3), np.empty((3, 3))
    for _ in range(20):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        actual = Rotation.random(rng=rng).as_matrix()
        axis_angle_matrix(axis, angle, turn)
        desired = turn @ actual
        rotation_error(desired, actual, error)
        assert np.linalg.norm(error) == pytest.approx(angle, abs=1e-7)
        np.testing.assert_allclose(rotation_matrix(error) @ actual, desired, atol=1e-6)
