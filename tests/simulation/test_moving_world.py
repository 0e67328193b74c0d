"""Objects really carried by belts and tables, seen by the camera and followed by a hand's frame."""

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.geometry.planar_motion import PlanarMotion
from graspbench.perception import CameraParameters, Station, look_at
from graspbench.simulation import EyeInHand, SceneParameters, World
from graspbench.simulation.moving_world import MovingWorld
from graspbench.simulation.ride import Ride
from graspbench.simulation.scene import TravelParameters
from tests.simulation.bodies import box


def yaw_deg(pose):
    return float(np.degrees(np.arctan2(pose[1, 0], pose[0, 0])))


def test_a_conveyor_carries_the_object_at_its_speed_past_where_it_is_put():
    scene = SceneParameters(motion="conveyor", x_m=0.02, travel=TravelParameters(direction_deg=90.0))
    with MovingWorld(box(), scene, lead_s=1.5) as world:
        before = world.object_pose()
        np.testing.assert_allclose(before[:2, 3], [0.02, -0.15], atol=2e-3)
        np.testing.assert_allclose(world.entry, [0.0, -0.15, 0.0], atol=1e-9)
        world.advance(1.5)
        after = world.object_pose()
    np.testing.assert_allclose(after[:2, 3], [0.02, 0.0], atol=2e-3)
    np.testing.assert_allclose((after - before)[:3, 3] / 1.5, [0.0, 0.1, 0.0], atol=1e-3)


def test_a_turntable_turns_the_object_about_its_axis():
    scene = SceneParameters(motion="turntable", travel=TravelParameters(axis_distance_m=0.04))
    with MovingWorld(box(), scene) as world:
        before = world.object_pose()
        world.advance(2.0)
        after = world.object_pose()
    assert yaw_deg(after @ np.linalg.inv(before)) == pytest.approx(60.0, abs=0.3)
    for pose in (before, after):
        assert np.linalg.norm(pose[:2, 3] - [-0.04, 0.0]) == pytest.approx(0.04, abs=1e-3)


def test_a_drift_swings_about_its_mean_pace():
    travel = TravelParameters(speed_m_s=0.05, turn_rate_deg_s=0.0, variation=0.4, period_s=4.0)
    scene = SceneParameters(motion="drift", travel=travel)
    with MovingWorld(box(), scene) as world:
        at = []
        for _ in range(3):
            at.append(world.object_pose()[0, 3])
            world.advance(2.0)
    # Mean of 1 + a sin over a half swing: 1 + 2 a / pi, and then 1 - 2 a / pi.
    np.testing.assert_allclose(np.diff(at) / 2.0, 0.05 * (1.0 + np.array([1, -1]) * 0.8 / np.pi), atol=1e-3)


def test_the_camera_sees_the_object_where_it_is_by_then():
    scene = SceneParameters(motion="conveyor", noise_std=0.0)
    with MovingWorld(box(), scene) as world, EyeInHand(world, CameraParameters()) as camera:
        columns = []
        for _ in range(2):
            centre = world.object_pose()[:3, 3]
            above = look_at(np.array([0.0, 0.0, 0.6]), np.zeros(3))
            view = camera.take(Station("top", above))
            assert view.time_s == world.time_s
            reddish = view.image[..., 0].astype(int) - view.image[..., 2] > 40
            seen = np.argwhere(reddish).mean(axis=0)[::-1]
            columns.append(seen[0])
            np.testing.assert_allclose(view.camera.project(centre[None])[0], seen, atol=12.0)
            world.advance(1.0)
    assert columns[1] - columns[0] == pytest.approx(750.0 * 0.1 / 0.55, rel=0.1)


def test_a_world_at_rest_refuses_a_scene_that_moves():
    with pytest.raises(ConfigurationError, match=r"scene\.motion = drift cannot be used here"):
        World(box(), SceneParameters(motion="drift"))


def test_a_hand_rides_along_and_comes_to_rest_without_a_jerk():
    motion = PlanarMotion(np.array([0.1, 0.0, 0.0]), 3.0, (0.1, 0.0), 0.5)
    ride = Ride(motion, 5.0)
    np.testing.assert_allclose(ride.displacement(1.0), motion.displacement(6.0), atol=1e-12)
    ride.halt(1.0, 0.4)
    np.testing.assert_allclose(ride.displacement(0.9), motion.displacement(5.9), atol=1e-12)
    np.testing.assert_allclose(ride.displacement(1.4), ride.displacement(3.0), atol=1e-12)
    # Half of the way that the full speed would have gone.
    np.testing.assert_allclose(ride.displacement(2.0), motion.displacement(6.2), atol=1e-12)
    times = np.linspace(0.9, 1.5, 601)
    speeds = np.linalg.norm(np.diff(ride.displacements(times)[:, :2, 3], axis=0), axis=1) / 1e-3
    assert np.abs(np.diff(speeds)).max() < 1e-3
