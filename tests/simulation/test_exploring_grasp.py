"""A grasp that only feels tells where the object is and leaves it there."""

from types import SimpleNamespace

import numpy as np
import pybullet
import pytest

from graspbench.hand import HandParameters, load_hand
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.exploring_grasp import feel_grasp
from tests.simulation.test_grasp_execution import cylinder, planned, tip


@pytest.fixture(scope="module")
def hand():
    return load_hand(HandParameters(fingers=3))


def test_fingers_feel_a_cylinder_where_it_is_and_the_hand_withdraws(hand):
    model = cylinder(friction=0.5)
    grasp, path = planned(hand, model)
    with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
        before = world.object_pose()
        bodies = pybullet.getNumBodies(physicsClientId=world.client)
        found = feel_grasp(world, hand, grasp, path, 0, ExecutionParameters(), tip())
        after = world.object_pose()
        hands = range(bodies, pybullet.getNumBodies(physicsClientId=world.client))
        nearest = min(
            point[8]
            for body in hands
            for point in pybullet.getClosestPoints(body, world.object_id, 0.05, physicsClientId=world.client)
        )
    assert found.contacts is not None
    points, inward = found.contacts[:, 0], found.contacts[:, 1]
    radius = 0.5 * float(np.ptp(model.mesh.bounds[:, 0]))
    np.testing.assert_allclose(np.linalg.norm(points[:, :2], axis=1), radius, atol=1e-3)
    np.testing.assert_allclose(inward, -grasp.normals, atol=0.05)
    np.testing.assert_allclose(points, grasp.points, atol=3e-3)
    assert np.linalg.norm(after[:3, 3] - before[:3, 3]) < 1e-3
    assert nearest > 0.005  # its path begins 10 mm away
    assert found.time_s > path.times[-1]


def test_fingers_that_meet_nothing_feel_nothing(hand):
    model = cylinder(friction=0.5)
    grasp, path = planned(hand, model)
    with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
        world.put_object(world.object_pose() + np.array([[0, 0, 0, 0.5], *[[0.0] * 4] * 3]))
        found = feel_grasp(world, hand, grasp, path, 0, ExecutionParameters(), tip())
    assert found.contacts is None


def test_the_way_back_begins_where_the_fingers_touch():
    from graspbench.simulation.exploring_grasp import _withdrawal

    path = SimpleNamespace(
        times=np.array([0.0, 0.1, 0.2, 0.4]),
        joints=np.array([[9.0], [1.0], [2.0], [3.0]]),
        transform_palm_to_world=np.tile(np.eye(4), (4, 1, 1)),
    )
    back = _withdrawal(path, 1, np.array([2.5]))
    np.testing.assert_allclose(back.joints[:, 0], [2.5, 1.75, 1.0])
    np.testing.assert_allclose(back.times, [0.0, 0.1, 0.3])
