"""From silhouettes to joint paths on a sample of random objects, with both hands, independently checked."""

import numpy as np
import pytest
import trimesh

from graspbench.experiment import load_config
from graspbench.geometry import load_object
from graspbench.grasp.closure import force_closure
from graspbench.hand import GraspChecker, load_hand
from graspbench.planning import fingertip_paths, grip_geometry, make_index, plan_local, track
from graspbench.reconstruction import reconstruct
from tests.oracles.hand_posture import judge
from tests.oracles.rasterise import exact_silhouettes, ring_of_cameras


def surfaces_of(number):
    """Reconstruct a random object, on its most likely side, from exact silhouettes."""
    config = load_config(["object=random", f"object.id={number}"])
    mesh = load_object(config.object).mesh.copy()
    mesh.apply_transform(trimesh.poses.compute_stable_poses(mesh.convex_hull, n_samples=1)[0][0])
    cameras = ring_of_cameras(mesh.center_mass)
    return list(reconstruct(exact_silhouettes(mesh.vertices, mesh.faces, cameras), config.surface))


@pytest.fixture(scope="module", params=[162, 459])
def surfaces(request):
    return surfaces_of(request.param)


@pytest.fixture(params=["radial", "allegro"])
def planned(surfaces, request):
    config = load_config([f"hand={request.param}", "hand.fingers=3"])
    hand = load_hand(config.hand)
    checker = GraspChecker(hand, 0.0)
    index = make_index(config.index_name, config.index, 3, config.quality)
    plan = plan_local(iter(surfaces), index, checker, 3, config.planner, config.quality)
    return config, checker, plan


def test_grasp_and_motion_keep_every_limit(surfaces, planned):
    config, checker, plan = planned
    grasp, hand, last = plan.grasp, checker.hand, surfaces[-1]

    body = trimesh.Trimesh(last.points, last.network.faces, process=False)
    assert checker.verify(grasp.posture, grasp.points, grasp.normals, body) == ()
    judged = judge(config.hand, hand, grasp.posture, grasp.points, grasp.normals, body)
    assert judged.faults(hand.margins.singular_value_m) == []
    length = config.quality.torque_length_m(last.points, last.centroid)
    assert force_closure(grasp.points, -grasp.normals, last.centroid, config.quality, length)
    assert grip_geometry(grasp.points, grasp.centroid).plane_offset_m < 2e-3

    planner = config.planner
    paths = fingertip_paths(plan.history, planner.paths, planner.floating_distance_m, hand)
    motion = track(paths, hand, grasp.posture, planner.paths)
    assert motion.tip_error_m.max() < 0.5e-3
    assert np.all(motion.joints >= hand.lower - 1e-12)
    assert np.all(motion.joints <= hand.upper + 1e-12)
    assert np.all(np.abs(motion.velocities) <= hand.velocity_limits)
    jumps = np.abs(np.diff(motion.velocities, axis=0)).max()
    assert jumps <= planner.paths.acceleration_limit_rad_s2 * planner.paths.time_step_s * (1 + 1e-6)
