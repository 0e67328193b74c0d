from dataclasses import replace

import numpy as np
import pybullet
import pytest
import trimesh

from graspbench.errors import SimulationError
from graspbench.simulation import SceneParameters, World
from tests.simulation.bodies import box, cone, model_of

SCENE = SceneParameters()


def placed(model, world):
    return trimesh.transform_points(model.mesh.vertices, world.transform_object_to_world)


@pytest.mark.parametrize("make", [box, cone])
def test_an_upright_object_stays_upright_on_the_table(make):
    model = make()
    with World(model, SCENE) as world:
        points = placed(model, world)
    assert points[:, 2].min() == pytest.approx(0.0, abs=3e-4)
    np.testing.assert_allclose(np.ptp(points[:, 2]), model.extents_m[2], atol=1e-5)


def test_the_pose_is_that_of_the_objects_own_frame():
    mesh = trimesh.creation.box((0.03, 0.06, 0.02))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(30), (0, 0, 1)))
    model = model_of(mesh)
    with World(model, replace(SCENE, yaw_deg=25.0, x_m=0.1, y_m=-0.05)) as world:
        pose = world.transform_object_to_world
    turn = np.radians(25)
    expected = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    np.testing.assert_allclose(pose[:3, :3], expected, atol=2e-3)
    np.testing.assert_allclose(pose[:3, 3], (0.1, -0.05, 0.01), atol=3e-4)


def test_the_objects_own_yaw_comes_first():
    turned = replace(box(), yaw_deg=40.0)
    with World(turned, replace(SCENE, yaw_deg=20.0)) as world:
        x_axis = world.transform_object_to_world[:3, 0]
    assert np.degrees(np.arctan2(x_axis[1], x_axis[0])) == pytest.approx(60.0, abs=0.3)


def test_a_tilted_box_falls_on_a_face():
    mesh = trimesh.creation.box((0.06, 0.04, 0.1))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(30), (0, 1, 0)))
    model = model_of(mesh)
    with World(model, SCENE) as world:
        height = np.ptp(placed(model, world)[:, 2])
    assert min(abs(height - side) for side in (0.04, 0.06, 0.1)) < 5e-4


def test_several_convex_parts_collide_as_one_body():
    left, right = (trimesh.creation.box((0.02, 0.05, 0.04)) for _ in range(2))
    left.apply_translation((-0.03, 0, 0))
    right.apply_translation((0.03, 0, 0))
    bridge = trimesh.creation.box((0.08, 0.05, 0.01))
    bridge.apply_translation((0, 0, 0.025))
    whole = trimesh.boolean.union([left, right, bridge])
    shift = -whole.center_mass
    for part in (left, right, bridge):
        part.apply_translation(shift)
    model = model_of(whole, parts=(left, right, bridge))
    with World(model, SCENE) as world:
        probe = pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE, radius=0.005, physicsClientId=world.client
        )
        gap = world.transform_object_to_world[:3, 3] + (0, 0, -0.012)
        ball = pybullet.createMultiBody(0.0, probe, basePosition=gap.tolist(), physicsClientId=world.client)
        near = pybullet.getClosestPoints(ball, world.object_id, 0.002, physicsClientId=world.client)
        assert not near, "the space between the legs is free"


def test_mass_inertia_and_friction_are_the_objects():
    model = cone()
    with World(model, SCENE) as world:
        info = pybullet.getDynamicsInfo(world.object_id, -1, physicsClientId=world.client)
    assert info[0] == pytest.approx(0.2)
    assert info[1] == pytest.approx(0.6)
    np.testing.assert_allclose(np.sort(info[2]), np.linalg.eigvalsh(model.inertia), rtol=1e-6)


def test_the_seed_draws_an_open_yaw():
    def yaw(seed):
        with World(box(), replace(SCENE, yaw_deg=None), seed) as world:
            return world.transform_object_to_world

    np.testing.assert_array_equal(yaw(1), yaw(1))
    assert not np.allclose(yaw(1)[:3, :3], yaw(2)[:3, :3], atol=0.05)


def test_an_object_that_does_not_settle_in_time_is_an_error():
    with pytest.raises(SimulationError, match="'sample' does not come to rest"):
        World(box(), replace(SCENE, drop_height_m=1.0, settle_time_s=0.25))


def test_worlds_do_not_disturb_each_other_and_close_twice():
    first, second = World(box(), SCENE), World(cone(), replace(SCENE, x_m=0.2))
    before = second.object_pose()
    first.close()
    first.close()
    np.testing.assert_array_equal(second.object_pose(), before)
    second.close()
    assert pybullet.getConnectionInfo(physicsClientId=second.client)["isConnected"] == 0
