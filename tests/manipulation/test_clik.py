from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.manipulation import charts
from graspbench.manipulation.clik import Clik, ClikParameters, PriorityChange
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.loop import simulate
from graspbench.manipulation.motion import Segment, Trajectory, line
from graspbench.manipulation.secondary_task import build_tasks
from graspbench.manipulation.transpose_gain import stable_gains
from tests.manipulation.cases import random_tree
from tests.oracles.prioritised_velocity import prioritised_velocity


@pytest.fixture(scope="module")
def ball():
    """Four fingers of seven joints round a ball, one of each contact type; well conditioned."""
    rng = np.random.default_rng(4)
    tree = random_tree(rng, fingers=4, joints=7, shared=0)
    joints = rng.uniform(-1.0, 1.0, tree.n_joints)
    kinds = ("hard", "rolling", "frictionless", "hard")
    directions = np.array([[1.0, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]) / np.sqrt(3)
    contacts = [
        Contact(charts.sphere(0.05, towards=direction), kind, 0.01)
        for kind, direction in zip(kinds, directions, strict=True)
    ]
    probe = ManipulationSystem(tree, contacts).state(joints, np.zeros((4, 5)))
    translations = tree.placement_translations.copy()
    for i in range(4):
        translations[7 * i] += 0.06 * directions[i] - probe.tip_positions[i]
    tree = replace(tree, placement_translations=translations)
    system, variables = ManipulationSystem(tree, contacts).grasped(joints, np.zeros(3), np.eye(3))
    return system, joints, variables


def motion(duration=1.0, rotation=(0.0, 0.1, 0.15)):
    path = line(np.zeros(3), np.array([0.01, 0.02, -0.01]))
    return Trajectory([Segment(duration, 0.0, path, np.array(rotation))], np.eye(3))


def still(position=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)):
    point = np.array(position)
    turned = Rotation.from_rotvec(rotation).as_matrix()
    return Trajectory([Segment(1.0, 0.0, line(point, point), np.zeros(3))], turned)


def worst_pose_error(history):
    return np.linalg.norm(history.pose_errors, axis=2).max()


@pytest.mark.parametrize(("integrator", "bound"), [("euler", 5e-4), ("heun", 1e-5), ("rk4", 1e-7)])
def test_pose_error_falls_with_the_order_of_integration(ball, integrator, bound):
    system, joints, variables = ball
    parameters = ClikParameters(step_s=2e-3, integrator=integrator)
    history = simulate(Clik(system, motion(), parameters), joints, variables, 1.0)
    assert worst_pose_error(history) < bound
    assert history.closed_chain_residual_m.max() < bound
    # and the object did move
    assert np.linalg.norm(history.object_positions[-1, 0] - history.object_positions[0, 0]) > 0.02


def test_order_of_convergence():
    """Halving the period divides Euler's pose error by two and Heun's by eight or so."""
    errors = {}
    for integrator in ("euler", "heun"):
        for period in (4e-3, 2e-3):
            system, joints, variables = _single()
            parameters = ClikParameters(step_s=period, integrator=integrator, gain=20.0, rotation_gain=20.0)
            history = simulate(Clik(system, motion(), parameters), joints, variables, 1.0)
            errors[integrator, period] = worst_pose_error(history)
    assert errors["euler", 4e-3] / errors["euler", 2e-3] == pytest.approx(2.0, rel=0.2)
    assert errors["heun", 4e-3] / errors["heun", 2e-3] > 3.5


def _single():
    rng = np.random.default_rng(7)
    tree = random_tree(rng, fingers=1, joints=7, shared=0)
    joints = rng.uniform(-1, 1, 7)
    contacts = [Contact(charts.sphere(0.05), "hard", 0.01)]
    tip = ManipulationSystem(tree, contacts).state(joints, np.zeros((1, 5))).tip_positions[0]
    translations = tree.placement_translations.copy()
    translations[0] += np.array([0.06, 0, 0]) - tip
    tree = replace(tree, placement_translations=translations)
    system, variables = ManipulationSystem(tree, contacts).grasped(joints, np.zeros(3), np.eye(3))
    return system, joints, variables


@pytest.mark.parametrize("method", ["pseudo_inverse", "transpose"])
def test_both_methods_converge_to_a_pose(ball, method):
    system, joints, variables = ball
    gain = 20.0 if method == "pseudo_inverse" else 100.0
    parameters = ClikParameters(method=method, gain=gain, rotation_gain=gain, step_s=2e-3)
    clik = Clik(system, still((0.004, -0.003, 0.005), (0.05, 0.04, -0.06)), parameters)
    duration = 1.0 if method == "pseudo_inverse" else 4.0
    history = simulate(clik, joints, variables, duration)
    error = np.linalg.norm(history.pose_errors, axis=2).max(axis=1)
    assert error[0] > 5e-2
    if method == "pseudo_inverse":
        assert error[-1] < 1e-6 * error[0]
    else:  # the slowest direction decays with the square of the smallest singular value
        assert error[-1] < 0.1 * error[0]
        contact_errors = np.linalg.norm(history.pose_errors, axis=(1, 2))
        assert np.all(np.diff(contact_errors[10:]) < 0.0)


def test_transpose_gains_come_from_the_jacobian(ball):
    """The loop's fastest rate is 0.8 a period, so it is stable, and quicker than with one gain for both."""
    system, joints, variables = ball
    parameters = ClikParameters(method="transpose", integrator="euler", step_s=1e-3)
    pose = still((0.004, -0.003, 0.005), (0.05, 0.04, -0.06))
    clik = Clik(system, pose, parameters)
    history = simulate(clik, joints, variables, 2.0)
    error = np.linalg.norm(history.pose_errors[:, :, :3], axis=(1, 2))
    assert error[-1] < 0.05 * error[0]
    # the same loop with one given gain of 100 for both is far slower
    slow = Clik(system, pose, replace(parameters, gain=100.0, rotation_gain=100.0))
    left = simulate(slow, joints, variables, 2.0).pose_errors[-1, :, :3]
    assert error[-1] < 0.5 * np.linalg.norm(left)
    # a unit error of each finger in turn gives the loop's matrix, and its spectral radius
    gains = stable_gains(system.state(joints, variables), clik.scale, 1e-3)
    state = system.state(joints, variables)
    loop = np.zeros((24, 24))
    for i in range(4):
        for k in range(6):
            pose_error = np.zeros((4, 6))
            pose_error[i, k] = 1.0
            contact = [state.grasp_transpose(j) @ (pose_error[j] * np.repeat(gains, 3)) for j in range(4)]
            velocity = clik.scale**2 * (state.jacobian.T @ np.concatenate(contact))
            moved = state.jacobian @ velocity
            loop[:, 6 * i + k] = np.concatenate(
                [np.linalg.solve(state.grasp_transpose(j), moved[6 * j : 6 * j + 6]) for j in range(4)]
            )
    assert 1e-3 * np.abs(np.linalg.eigvals(loop)).max() == pytest.approx(0.8)


def test_pseudo_inverse_error_decays_at_the_gain(ball):
    system, joints, variables = ball
    parameters = ClikParameters(gain=10.0, rotation_gain=10.0, step_s=1e-3, integrator="rk4")
    clik = Clik(system, still((0.004, -0.003, 0.005)), parameters)
    history = simulate(clik, joints, variables, 0.2)
    length = np.linalg.norm(history.pose_errors[:, 0, :3], axis=1)
    np.testing.assert_allclose(length[-1] / length[0], np.exp(-10.0 * 0.2), rtol=1e-6)


def test_hard_contacts_keep_their_place_and_rolling_ones_move(ball):
    system, joints, variables = ball
    history = simulate(Clik(system, motion(), ClikParameters(step_s=2e-3)), joints, variables, 1.0)
    moved = np.abs(history.contact_variables[-1, :, :2] - variables[:, :2]).max(axis=1)
    np.testing.assert_array_equal(moved[[0, 3]], 0.0)
    assert moved[1] > 1e-4


def test_secondary_tasks_do_not_touch_the_main_task(ball):
    system, joints, variables = ball
    options = {"joint_centring": {"gain": 3.0, "posture": tuple(joints + 0.3), "ramp_s": 0.2}}
    parameters = ClikParameters(step_s=2e-3, integrator="rk4", reference="held")
    with_tasks = simulate(Clik(system, motion(), parameters, build_tasks(options)), joints, variables, 1.0)
    without = simulate(Clik(system, motion(), parameters), joints, variables, 1.0)
    a, b = (np.linalg.norm(h.pose_errors, axis=2).mean(axis=1) for h in (with_tasks, without))
    moving = b > 1e-9
    assert moving.sum() > 400
    assert np.abs(a - b)[moving].max() < 1e-3 * b.max()
    assert np.linalg.norm(with_tasks.joints[-1] - without.joints[-1]) > 0.1


def test_null_space_velocities_leave_the_object(ball):
    system, joints, variables = ball
    options = {"joint_centring": {"gain": 3.0, "posture": (0.5,) * 28, "start_s": -9.0}}
    clik = Clik(system, still(), ClikParameters(), build_tasks(options))
    velocity = clik.velocity(0.5, joints, variables)
    assert np.linalg.norm(velocity) > 0.1
    np.testing.assert_allclose(clik.state.jacobian @ velocity, 0.0, atol=1e-12)


def test_weights_shift_motion_between_variables(ball):
    system, joints, variables = ball
    desired = motion()
    columns = system.xi_columns[system.xi_columns >= 0]
    speeds = []
    for weight in (0.01, 1.0, 100.0):
        clik = Clik(system, desired, ClikParameters(sliding_weight=weight))
        velocity = clik.velocity(0.5, joints, variables)
        speeds.append(np.linalg.norm(velocity[columns]))
        wanted = clik.wanted
        np.testing.assert_allclose(clik.state.jacobian @ velocity, wanted, atol=1e-9)
        # the closed form of the weighted right inverse
        w = clik.scale**2
        j = clik.state.jacobian
        expected = (w[:, None] * j.T) @ np.linalg.solve(j @ (w[:, None] * j.T), wanted)
        np.testing.assert_allclose(velocity, expected, atol=1e-9)
    assert speeds[0] > speeds[1] > speeds[2]


def test_augmented_projection_matches_its_formula(ball):
    """(4.13) with pinv and dense projectors, for three fully active tasks."""
    system, joints, variables = ball
    options = {
        "apart": {
            "kind": "fingertip_distance",
            "first": 0,
            "second": 1,
            "minimum_m": 0.5,
            "threshold_m": 0.6,
        },
        "near": {"kind": "contacts_near_point", "contacts": [2], "point_m": (0.0, 0.05, 0.0), "priority": 1},
        "posture": {"kind": "joint_centring", "posture": (0.2,) * 28, "priority": 2},
    }
    for values in options.values():
        values["start_s"] = -9.0
    tasks = build_tasks(options)
    clik = Clik(system, motion(), ClikParameters(), tasks)
    velocity = clik.velocity(0.4, joints, variables)
    jacobian, state = clik.state.jacobian, clik.state
    expected = np.linalg.pinv(jacobian) @ clik.wanted
    above = jacobian
    for task in tasks.values():
        value = task.evaluate(state)
        projector = np.eye(system.n_variables) - np.linalg.pinv(above, rcond=1e-9) @ above
        expected += projector @ np.linalg.pinv(value.jacobian, rcond=1e-6) @ (task.gain * value.error)
        above = np.vstack([above, value.jacobian])
    # the projectors' damping is the difference
    np.testing.assert_allclose(velocity, expected, atol=2e-3 * np.abs(expected).max())


def test_velocity_has_no_jump_when_tasks_enter_leave_and_swap(ball):
    system, joints, variables = ball
    options = {
        "apart": {
            "kind": "fingertip_distance", "first": 0, "second": 1, "minimum_m": 0.09, "threshold_m": 0.12,
            "start_s": 0.2, "end_s": 1.2, "ramp_s": 0.3,
        },
        "posture": {
            "kind": "joint_centring", "posture": (0.2,) * 28, "priority": 1, "start_s": 0.1, "ramp_s": 0.3,
        },
    }  # fmt: skip
    largest = []
    for period in (2e-3, 1e-3):
        parameters = ClikParameters(
            step_s=period,
            transition_s=0.3,
            priority_changes=(PriorityChange(0.7, ("posture", "apart")),),
        )
        clik = Clik(system, motion(1.6), parameters, build_tasks(options))
        history = simulate(clik, joints, variables, 1.6)
        assert history.activations.max(axis=0).min() > 0.0
        largest.append(np.abs(np.diff(history.velocities, axis=0)).max())
    # a jump would stay as it is when the period is halved; a continuous velocity halves
    assert largest[1] < 0.6 * largest[0]


def test_a_swap_changes_who_wins(ball):
    system, joints, variables = ball
    options = {
        "one": {"kind": "joint_centring", "posture": (0.5,) * 28, "start_s": -9.0},
        "two": {"kind": "joint_centring", "posture": (-0.5,) * 28, "start_s": -9.0, "priority": 1},
    }
    change = PriorityChange(1.0, ("two", "one"))
    clik = Clik(system, still(), ClikParameters(priority_changes=(change,)), build_tasks(options))
    before = clik.velocity(0.5, joints, variables)
    during = clik.velocity(1.25, joints, variables)
    after = clik.velocity(2.0, joints, variables)
    np.testing.assert_allclose(during, 0.5 * (before + after), atol=1e-9)
    assert np.linalg.norm(before - after) > 0.1


def test_damping_bounds_the_velocity_near_a_singularity():
    system, joints, variables = _single()
    joints = joints.copy()
    desired = motion()
    free = ClikParameters(singular_threshold=0.0)
    damped = ClikParameters(singular_threshold=10.0, largest_damping=5.0)
    fast = Clik(system, desired, free).velocity(0.5, joints, variables)
    slow = Clik(system, desired, damped).velocity(0.5, joints, variables)
    assert np.linalg.norm(slow) < np.linalg.norm(fast)


def test_smallest_singular_value_is_that_of_the_jacobian(ball):
    system, joints, variables = ball
    clik = Clik(system, motion(), ClikParameters())
    clik.velocity(0.5, joints, variables)
    exact = np.linalg.svd(clik.state.jacobian, compute_uv=False)[-1]
    assert exact <= clik.smallest_singular_value <= 1.2 * exact


def test_too_few_variables_are_refused():
    rng = np.random.default_rng(9)
    tree = random_tree(rng, fingers=2, joints=3, shared=0)
    system = ManipulationSystem(tree, [Contact(charts.plane(), "soft")] * 2)
    with pytest.raises(ConfigurationError, match="fix 12 velocities but hand and contacts have 10"):
        Clik(system, still(), ClikParameters())


def test_leaving_the_chart_is_told(ball):
    system, joints, variables = ball
    small = replace(system.contacts[1].chart, domain=np.array([[-1e-4, 1e-4]] * 2))
    contacts = [*system.contacts]
    contacts[1] = Contact(small, "rolling", 0.01)
    narrow = ManipulationSystem(system.tree, contacts)
    with pytest.raises(ManipulationError, match="contact 1 left its surface chart") as caught:
        simulate(Clik(narrow, motion(), ClikParameters(step_s=2e-3)), joints, variables, 1.0)
    assert 0.0 < caught.value.data["time_s"] < 1.0


def test_wrong_priorities_are_refused(ball):
    change = PriorityChange(1.0, ("nobody",))
    with pytest.raises(ConfigurationError, match="name all of joint_limit once"):
        Clik(ball[0], still(), ClikParameters(priority_changes=(change,)), build_tasks({"joint_limit": {}}))


@pytest.mark.parametrize("shared", [0, 1])
def test_step_equals_plain_linear_algebra(shared):
    """Fingers factorised one by one, and single rows in closed form, change nothing."""
    rng = np.random.default_rng(11 + shared)
    tree = random_tree(rng, fingers=4, joints=7, shared=shared)
    kinds = ("frictionless", "rolling", "soft", "hard")
    system = ManipulationSystem(tree, [Contact(charts.sphere(0.05), kind, 0.01) for kind in kinds])
    n = tree.n_joints
    options = {
        "joint_limit": {"upper": (0.5,) * n, "lower": (-0.5,) * n, "margin": 0.4, "gain": 3.0},
        "fingertip_distance": {"minimum_m": 0.1, "threshold_m": 1.0, "priority": 1},
        "quality_measure": {"measure": "q2", "priority": 2},
        "contacts_near_point": {"contacts": (0, 1), "priority": 3},
        "joint_centring": {"posture": (0.1,) * n, "priority": 4},
    }
    for values in options.values():
        values |= {"start_s": 0.0, "ramp_s": 1.0}
    tasks = build_tasks(options)
    law = Clik(system, motion(), ClikParameters(sliding_weight=2.0, joint_weight=0.5), tasks)
    for _ in range(20):
        joints, variables = rng.uniform(-1, 1, n), rng.uniform(-0.5, 0.5, (4, 5))
        velocity = law.velocity(0.6, joints, variables)
        blocks = []
        for task in tasks.values():
            value = task.evaluate(law.state)
            if value is None:
                continue
            wanted, activation = task.gain * value.error, task.presence(0.6) * value.activation
            if np.ndim(activation):
                blocks += [
                    (value.jacobian[r : r + 1], wanted[r : r + 1], activation[r]) for r in range(len(wanted))
                ]
            else:
                blocks.append((value.jacobian, wanted, activation))
        assert len(blocks) >= 5
        expected = prioritised_velocity(law.state.jacobian, law.wanted, law.scale, blocks)
        np.testing.assert_allclose(velocity, expected, atol=1e-9 * max(1.0, np.abs(expected).max()))
        np.testing.assert_allclose(law.contact_rates, law.state.rates(velocity), atol=1e-12)
