"""The exact test of a hand against triangles agrees with Coal; a posture that sinks in is refused."""

import coal
import numpy as np
import pytest
import trimesh

from graspbench.hand import GraspChecker
from graspbench.hand.penetration import DEPTH_M, balls_sink, links_sink, triangles_of
from graspbench.hand.task import make_system
from tests.hand.conftest import random_joints
from tests.oracles.hand_posture import bounding_surface, depth_in_object


def bumpy_ball(seed, radius=0.04):
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    rng = np.random.default_rng(seed)
    mesh.vertices *= rng.uniform(0.8, 1.2, (len(mesh.vertices), 1))
    return mesh


def test_balls_sink_where_coal_says_so():
    mesh = bumpy_ball(1)
    rng = np.random.default_rng(2)
    centres = rng.uniform(-0.055, 0.055, (400, 3))
    surface = bounding_surface(mesh)
    grain, request = coal.Sphere(1e-7), coal.DistanceRequest()
    gaps = np.array(
        [
            coal.distance(
                grain,
                coal.Transform3s(np.eye(3), c),
                surface,
                coal.Transform3s.Identity(),
                request,
                coal.DistanceResult(),
            )
            for c in centres
        ]
    )
    found = np.empty(len(centres), dtype=bool)
    for radius in (0.004, 0.008, 0.02):
        balls_sink(triangles_of(mesh.vertices, mesh.faces), centres, radius, found)
        clear = np.abs(gaps - radius) > 1e-5
        np.testing.assert_array_equal(found[clear], (gaps < radius)[clear])
        assert 20 < found.sum() < 380


def test_points_alone_are_obstacles_too():
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (50, 3))
    centres = np.random.default_rng(1).uniform(-0.1, 0.1, (200, 3))
    found = np.empty(200, dtype=bool)
    balls_sink(triangles_of(points, None), centres, 0.03, found)
    nearest = np.linalg.norm(centres[:, None] - points[None], axis=2).min(axis=1)
    np.testing.assert_array_equal(found, nearest < 0.03)
    balls_sink(triangles_of(points[:0], None), centres, 0.03, found)
    assert not found.any()


@pytest.mark.parametrize("idle", [False, True])
def test_links_sink_where_coal_says_so(hand, idle):
    rng = np.random.default_rng(7)
    contact_of = np.full(hand.n_fingers, -1 if idle else 0)
    system, agreed = make_system(hand.chains, hand.shapes), {True: 0, False: 0}
    for seed in range(30):
        mesh = bumpy_ball(seed % 3)
        mesh.apply_translation(rng.uniform(-0.06, 0.06, 3) + np.array([0.0, 0.0, 0.11]))
        joints, pose = hand.joint_vector(hand.by_finger(random_joints(hand, rng))), np.eye(4)
        pose[:3, :3] = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
        mesh.apply_transform(pose)
        depth = depth_in_object(hand, joints, pose, mesh, with_tips=idle)
        if abs(depth - DEPTH_M) < 1e-5:
            continue
        found = links_sink(
            hand.chains,
            hand.shapes,
            triangles_of(mesh.vertices, mesh.faces),
            contact_of,
            np.ascontiguousarray(pose[:3]),
            hand.by_finger(joints),
            system,
            DEPTH_M,
        )
        assert found == (depth > DEPTH_M)
        agreed[found] += 1
    assert min(agreed.values()) >= 3


def test_a_thin_edge_between_the_points_is_no_way_through(radial):
    """A plate whose few points are all far from the fingers, but not its triangles."""
    angle = 2 * np.pi * np.arange(3) / 3
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = 0.03 * normals + (0.0, 0.0, 0.06)
    checker = GraspChecker(radial)
    posture = checker.place(points, normals)
    assert posture is not None
    plate = np.array([[-0.5, -0.5, 0.11], [0.5, -0.5, 0.11], [0.0, 0.9, 0.11], [0.0, 0.0, 0.1]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3]])
    checker.set_object(plate, faces)
    refused = checker.place(points, normals)
    assert refused is None or refused.transform_palm_to_world[2, 2] > -0.5
