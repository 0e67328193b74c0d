from dataclasses import replace

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.manipulation import charts
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.integration import INTEGRATORS, step
from graspbench.manipulation.motion import Segment, Trajectory, line
from graspbench.manipulation.qp import DistanceLimit, QpParameters
from graspbench.manipulation.secondary_task import build_tasks
from tests.manipulation.cases import random_tree

PERIOD = 1e-2
MINIMUM = 0.05


def make_case(seed, *, outside=False):
    """Three fingers of five joints on a ball, with limits near the start and a random motion."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, fingers=3, joints=5, shared=0)
    joints = rng.uniform(-1.0, 1.0, 15)
    directions = np.array([[1.0, 0.2, 0], [-0.5, 0.8, 0.1], [-0.5, -0.8, -0.1]])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    kinds = ("hard", "frictionless", "hard")
    contacts = [
        Contact(charts.sphere(0.05, towards=d), k, 0.01) for d, k in zip(directions, kinds, strict=True)
    ]
    probe = ManipulationSystem(tree, contacts).state(joints, np.zeros((3, 5)))
    translations = tree.placement_translations.copy()
    for i in range(3):
        translations[5 * i] += 0.06 * directions[i] - probe.tip_positions[i]
    low, high = joints - rng.uniform(0.0, 0.3, 15), joints + rng.uniform(0.0, 0.3, 15)
    low[rng.random(15) < 0.2] = joints[0] - 9.0
    on = rng.integers(15, size=3)
    high[on] = joints[on]
    if outside:
        for joint in rng.integers(15, size=2):
            high[joint] = joints[joint] - rng.uniform(0.01, 0.2)
            low[joint] = high[joint] - 0.5
    low = np.minimum(low, high - 0.1)
    tree = replace(
        tree,
        placement_translations=translations,
        lower=low,
        upper=high,
        velocity_limits=rng.uniform(0.3, 1.0, 15),
    )
    system, variables = ManipulationSystem(tree, contacts).grasped(joints, np.zeros(3), np.eye(3))
    target = rng.uniform(-0.03, 0.03, 3)
    path = Trajectory([Segment(0.3, 0.0, line(np.zeros(3), target), rng.uniform(-0.3, 0.3, 3))], np.eye(3))
    return system, joints, variables, path


def tasks():
    return build_tasks(
        {
            "near": {"kind": "contacts_near_point", "contacts": [1], "point_m": (0.0, 0.05, 0.0)},
            "posture": {"kind": "joint_centring", "priority": 1},
        }
    )


def parameters(**given):
    pair = DistanceLimit(0, 1, MINIMUM)
    qp = QpParameters(limit_gain=1.0 / PERIOD, distances=(pair,))
    return ClikParameters(method="qp", integrator="euler", step_s=PERIOD, gain=20.0, qp=qp, **given)


@pytest.mark.parametrize("outside", [False, True])
@pytest.mark.parametrize("batch", range(5))
def test_no_limit_is_exceeded_on_random_trajectories(batch, outside):
    """Ten trajectories each, so 100 in all; half of them start beyond a limit."""
    for seed in range(10 * batch, 10 * batch + 10):
        system, q, eta, path = make_case(seed, outside=outside)
        tree = system.tree
        clik = Clik(system, path, parameters(), tasks())
        beyond = np.maximum(np.maximum(q - tree.upper, tree.lower - q), 0.0)
        assert (beyond.max() > 0.0) == outside
        for k in range(30):
            velocity = clik.velocity(k * PERIOD, q, eta)
            speed = np.abs(velocity[: system.n_joints])
            assert np.all(speed <= tree.velocity_limits + 1e-6)
            q, eta = step(clik, INTEGRATORS["euler"], k * PERIOD, PERIOD, q, eta, velocity, None)
            now = np.maximum(np.maximum(q - tree.upper, tree.lower - q), 0.0)
            assert np.all(now <= np.maximum(beyond, 0.0) + 1e-6)  # never farther out than it was
            # and back in as fast as the velocity limit allows
            expected = np.maximum(beyond - PERIOD * tree.velocity_limits, 0.0)
            assert np.all(now <= expected + 1e-6)
            beyond = now
            tips = clik.state.tip_positions
            assert np.linalg.norm(tips[0] - tips[1]) >= MINIMUM - 1e-6


def loosened(system):
    free = np.full(system.n_joints, 1e6)
    tree = replace(system.tree, lower=-free, upper=free, velocity_limits=free)
    return ManipulationSystem(tree, system.contacts)


def test_equals_the_projection_where_no_limit_is_active():
    system, q, eta, path = make_case(3)
    system = loosened(system)
    options = parameters()
    a = Clik(system, path, options, tasks()).velocity(0.1, q, eta)
    b = Clik(system, path, replace(options, method="pseudo_inverse"), tasks()).velocity(0.1, q, eta)
    np.testing.assert_allclose(a, b, atol=1e-12)


def test_levels_return_the_projection_too():
    """The quadratic programs themselves agree with it when no limit binds."""
    system, q, eta, path = make_case(3)
    system = loosened(system)
    clik = Clik(system, path, parameters(), tasks())
    velocity = clik.velocity(0.1, q, eta)
    hierarchy = clik._qp
    task = [task.evaluate(clik.state).jacobian for task in clik.tasks.values()]
    found = hierarchy._solve_levels(clik.state, velocity, clik.wanted, task)
    np.testing.assert_allclose(found, velocity, atol=1e-6)
    assert hierarchy.levels_solved >= 2


def test_the_object_comes_before_the_tasks_when_a_limit_binds():
    """Where the joints can still move the object, a limit costs the tasks and not the object."""
    system, q, eta, path = make_case(7)
    free = loosened(system)
    clik = Clik(free, path, parameters(), tasks())
    velocity = clik.velocity(0.15, q, eta)
    joint = int(np.argmax(np.abs(velocity[: free.n_joints])))
    limits = np.full(free.n_joints, 1e6)
    limits[joint] = 0.7 * abs(velocity[joint])
    tight = ManipulationSystem(replace(free.tree, velocity_limits=limits), free.contacts)
    bound = Clik(tight, path, parameters(), tasks())
    limited = bound.velocity(0.15, q, eta)
    assert abs(limited[joint]) <= limits[joint] + 1e-9
    np.testing.assert_allclose(bound.state.jacobian @ limited, bound.wanted, atol=1e-5)
    assert bound._qp.levels_solved >= 2


def test_velocity_is_continuous_where_a_limit_begins_to_bind():
    system, q, eta, path = make_case(7)
    free = loosened(system)
    velocity = Clik(free, path, parameters(), tasks()).velocity(0.15, q, eta)
    joint = int(np.argmax(np.abs(velocity[: free.n_joints])))
    for share in (1.0 - 1e-4, 1.0 - 1e-3):
        limits = np.full(free.n_joints, 1e6)
        limits[joint] = share * abs(velocity[joint])
        tight = ManipulationSystem(replace(free.tree, velocity_limits=limits), free.contacts)
        limited = Clik(tight, path, parameters(), tasks()).velocity(0.15, q, eta)
        assert np.abs(limited - velocity).max() < 20.0 * (1.0 - share) * np.abs(velocity).max() + 1e-5


def test_only_a_held_velocity_keeps_limits():
    system, _, _, path = make_case(1)
    with pytest.raises(ConfigurationError, match=r"clik\.integrator=euler"):
        Clik(system, path, ClikParameters(method="qp", integrator="heun"))
