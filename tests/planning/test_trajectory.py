from dataclasses import replace

import numpy as np
import pytest

from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.planning.parameters import PathParameters
from graspbench.planning.tracking import track
from graspbench.planning.trajectory import fingertip_paths
from tests.planning.shapes import ellipsoid, lifted

HAND = load_hand(HandParameters(fingers=3))
PARAMETERS = PathParameters()
SURFACE = lifted(ellipsoid((0.032, 0.036, 0.05)), 0.06)


def configuration(azimuths_deg, heights, scale=1.0, posture=None):
    angles = np.deg2rad(azimuths_deg)
    rays = np.column_stack([np.cos(angles), np.sin(angles), heights])
    arms = SURFACE.points - SURFACE.centroid
    vertices = np.argmax(arms / np.linalg.norm(arms, axis=1, keepdims=True) @ rays.T, axis=0)
    points = SURFACE.centroid + scale * arms[vertices]
    return Grasp(vertices, points, SURFACE.normals[vertices], SURFACE.centroid, posture)


@pytest.fixture(scope="module")
def history():
    way = [
        configuration([0 + turn, 120 + turn, 240 + turn], [rise, 0.0, -rise], 1 + 0.02 * k)
        for k, (turn, rise) in enumerate([(0, 0.5), (8, 0.4), (16, 0.3), (24, 0.15), (30, 0.0)])
    ]
    last = configuration([30, 150, 270], [0.0, 0.0, 0.0])
    posture = GraspChecker(HAND).place(last.points, last.normals)
    assert posture is not None
    return [*way, Grasp(last.vertices, last.points, last.normals, last.centroid, posture)]


def test_tips_keep_their_distance_and_close_along_the_normal(history):
    paths = fingertip_paths(history, PARAMETERS, 0.02, HAND)
    grasp = history[-1]
    for path, point, normal in zip(paths, grasp.points, grasp.normals, strict=True):
        assert path.floating_distance_m == 0.02
        np.testing.assert_allclose(path.points[-1], point, atol=1e-12)
        heights = (path.grasp - point) @ normal
        np.testing.assert_allclose(path.grasp, point + heights[:, None] * normal, atol=1e-12)
        assert heights[0] == pytest.approx(0.02)
        assert np.all(np.diff(heights) < 0)
        np.testing.assert_allclose(path.approach[-1], path.grasp[0])
        np.testing.assert_allclose(np.linalg.norm(path.normals, axis=1), 1.0)
        # On the way the tip stays outside, at about the floating distance from the final surface.
        clear = np.linalg.norm(path.approach[:, None] - SURFACE.points[None], axis=2).min(axis=1)
        assert clear.min() > 0.015


def test_all_fingers_start_and_touch_together(history):
    paths = fingertip_paths(history, PARAMETERS, 0.02, HAND)
    for path in paths:
        np.testing.assert_array_equal(path.times, paths[0].times)
        assert path.closing == paths[0].closing
        assert len(path.times) == len(path.points) == len(path.normals)


def test_paths_are_at_rest_at_both_ends_and_between_approach_and_closing(history):
    for path in fingertip_paths(history, PARAMETERS, 0.02, HAND):
        speed = np.linalg.norm(np.diff(path.points, axis=0), axis=1) / PARAMETERS.time_step_s
        for k in (0, path.closing - 1, path.closing, len(speed) - 1):
            assert speed[k] < 0.1 * speed.max()
        jumps = np.linalg.norm(np.diff(path.points, 2, axis=0), axis=1) / PARAMETERS.time_step_s
        assert jumps.max() < 0.2 * speed.max()


def test_via_points_are_those_of_the_plan(history):
    paths = fingertip_paths(history, PARAMETERS, 0.02)
    for i, path in enumerate(paths):
        np.testing.assert_array_equal(path.via, [grasp.points[i] for grasp in history])
        assert path.contact == i


def test_grasp_without_a_way_still_closes(history):
    paths = fingertip_paths(history[-1:], PARAMETERS, 0.02, HAND)
    for path, point in zip(paths, history[-1].points, strict=True):
        assert path.closing == 0
        np.testing.assert_allclose(path.points[-1], point, atol=1e-12)


def test_configurations_too_wide_for_the_hand_are_left_out(history):
    wide = [configuration([0, 120, 240], [0, 0, 0], 8.0), configuration([10, 130, 250], [0, 0, 0], 6.0)]
    paths = fingertip_paths([*wide, *history], PARAMETERS, 0.02, HAND)
    for i, path in enumerate(paths):
        assert len(path.via) == len(history) + 2
        assert np.linalg.norm(path.points[0] - history[-1].points[i]) < 0.1


def tips(joint_path, posture):
    found = np.array([HAND.tip_positions(q)[list(posture.fingers)] for q in joint_path.joints])
    poses = joint_path.transform_palm_to_world
    return np.einsum("tab,tfb->tfa", poses[:, :3, :3], found) + poses[:, None, :3, 3]


@pytest.fixture(scope="module")
def motion(history):
    paths = fingertip_paths(history, PARAMETERS, 0.02, HAND)
    return paths, track(paths, HAND, history[-1].posture, PARAMETERS)


def test_tracking_error_is_small(history, motion):
    paths, path = motion
    assert path.tip_error_m.max() < 0.5e-3
    # Independently: the tips end on the contacts, and pass the paths' beginnings.
    world = tips(path, history[-1].posture)
    grasp = history[-1]
    np.testing.assert_allclose(world[-1], grasp.points + HAND.tip_radius_m * grasp.normals, atol=1e-4)
    first = np.array([p.points[0] + HAND.tip_radius_m * p.normals[0] for p in paths])
    np.testing.assert_allclose(world[path.following], first, atol=1e-4)
    closing = np.array([p.points[p.closing] + HAND.tip_radius_m * p.normals[p.closing] for p in paths])
    np.testing.assert_allclose(world[path.closing], closing, atol=5e-4)


def test_velocity_limits_are_kept_without_jumps(motion):
    _, path = motion
    assert np.all(np.abs(path.velocities) <= HAND.velocity_limits * PARAMETERS.velocity_share * (1 + 1e-9))
    np.testing.assert_allclose(np.diff(path.joints, axis=0) / PARAMETERS.time_step_s, path.velocities[:-1])
    step = PARAMETERS.acceleration_limit_rad_s2 * PARAMETERS.time_step_s
    assert np.abs(np.diff(path.velocities, axis=0)).max() <= step * (1 + 1e-6)
    assert np.abs(path.velocities[0]).max() == 0.0
    assert np.abs(path.velocities[-2]).max() < 0.05


def test_fast_paths_are_slowed_down_for_all_fingers_together(history, motion):
    fast = PathParameters(tip_speed_m_s=5.0, closing_time_s=0.02, acceleration_limit_rad_s2=1e6)
    paths = fingertip_paths(history, fast, 0.02, HAND)
    path = track(paths, HAND, history[-1].posture, fast)
    assert len(path.times) - path.following > len(paths[0].times)
    assert np.all(np.abs(path.velocities) <= HAND.velocity_limits * fast.velocity_share * (1 + 1e-9))
    assert path.tip_error_m.max() < 0.5e-3


def test_joints_stay_within_their_limits(motion):
    _, path = motion
    assert np.all(path.joints >= HAND.lower - 1e-12)
    assert np.all(path.joints <= HAND.upper + 1e-12)


def test_palm_arrives_against_its_approach_direction_and_stays(history, motion):
    _, path = motion
    final = history[-1].posture.transform_palm_to_world
    offset = path.transform_palm_to_world[:, :3, 3] - final[:3, 3]
    np.testing.assert_allclose(offset[0], -PARAMETERS.retreat_m * final[:3, 2], atol=1e-12)
    np.testing.assert_allclose(offset[path.following :], 0.0, atol=1e-12)
    np.testing.assert_allclose(
        path.transform_palm_to_world[:, :3, :3], np.tile(final[:3, :3], (len(offset), 1, 1))
    )
    speed = np.linalg.norm(np.diff(offset, axis=0), axis=1) / PARAMETERS.time_step_s
    assert speed.max() < 1.9 * PARAMETERS.tip_speed_m_s
    assert np.abs(np.diff(speed)).max() < 0.1 * speed.max()


def test_a_sharp_corner_slows_the_motion_down_only_there(history):
    corner = [configuration([turn, 120 + turn, 240 + turn], [0, 0, 0], 1.0) for turn in (10, 45, 12, 40, 14)]
    paths = fingertip_paths([*corner, history[-1]], PARAMETERS, 0.02, HAND)
    path = track(paths, HAND, history[-1].posture, PARAMETERS)
    step = PARAMETERS.acceleration_limit_rad_s2 * PARAMETERS.time_step_s
    jumps = np.abs(np.diff(path.velocities[path.following :], axis=0)).max(axis=1)
    assert jumps.max() <= step * (1 + 1e-6)
    # One slowdown for all of it would leave a single sharp moment.
    assert np.mean(jumps > 0.5 * step) > 0.05
    assert path.tip_error_m.max() < 0.5e-3


def test_what_a_finger_cannot_follow_is_refused(history):
    paths = list(fingertip_paths(history, PARAMETERS, 0.02, HAND))
    points = paths[0].points.copy()
    points[len(points) // 3] += 0.3 * paths[0].normals[len(points) // 3]
    paths[0] = replace(paths[0], points=points)
    with pytest.raises(PlanningError, match=r"finger '.*' cannot follow its path"):
        track(paths, HAND, history[-1].posture, PARAMETERS)


def test_a_way_of_a_millimetre_starts_and_ends_at_rest(history):
    last = history[-1]
    near = Grasp(last.vertices, last.points + 1e-3 * last.normals, last.normals, last.centroid, None)
    paths = fingertip_paths([near, last], PARAMETERS, 0.02, HAND)
    path = track(paths, HAND, last.posture, PARAMETERS)
    step = PARAMETERS.acceleration_limit_rad_s2 * PARAMETERS.time_step_s
    assert np.abs(np.diff(path.velocities, axis=0)).max() <= step * (1 + 1e-6)


def test_no_tip_goes_into_the_ground_on_its_way_and_all_end_on_their_contacts(history):
    last = history[-1]
    # The first configurations reach below the table, as an ellipsoid around a low object does.
    sunk = [replace(grasp, points=grasp.points - [0.0, 0.0, 0.015]) for grasp in history[:-1]]
    ground = float(last.points[:, 2].min()) - HAND.tip_radius_m - HAND.margins.ground_m - 1e-3
    below = lowest_tip_m(fingertip_paths([*sunk, last], PARAMETERS, 0.02, HAND))
    paths = fingertip_paths([*sunk, last], PARAMETERS, 0.02, HAND, ground)
    assert below < ground
    assert lowest_tip_m(paths) > ground + HAND.margins.ground_m - 1e-4
    for path, point in zip(paths, last.points, strict=True):
        np.testing.assert_allclose(path.points[-1], point, atol=1e-12)


def lowest_tip_m(paths):
    """Return the lowest point of all tips' spheres."""
    centres = np.stack([path.points + HAND.tip_radius_m * path.normals for path in paths])
    return float(centres[..., 2].min()) - HAND.tip_radius_m
