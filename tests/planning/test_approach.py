"""The hand's way to its grasp keeps clear of the object."""

from dataclasses import replace

import numpy as np

from graspbench.grasp.configuration import Grasp
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.hand.penetration import triangles_of
from graspbench.hand.swept import collisions
from graspbench.planning.approach import clear_approach
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.tracking import track
from graspbench.planning.trajectory import fingertip_paths
from tests.planning.shapes import ellipsoid, lifted

HAND = load_hand(HandParameters(fingers=3))
SURFACE = lifted(ellipsoid((0.032, 0.036, 0.05)), 0.06)
PLANNER = PlannerParameters()


def grasp_at(azimuths_deg, height, posture=None, through=1.0):
    angles = np.deg2rad(azimuths_deg)
    rays = np.column_stack((np.cos(angles), np.sin(angles), np.full(3, height)))
    arms = SURFACE.points - SURFACE.centroid
    vertices = np.argmax(arms / np.linalg.norm(arms, axis=1, keepdims=True) @ rays.T, axis=0)
    points, normals = SURFACE.centroid + through * arms[vertices], SURFACE.normals[vertices]
    return Grasp(vertices, points, normals, SURFACE.centroid, posture)


def held():
    last = grasp_at([30, 150, 270], 0.0)
    posture = GraspChecker(HAND).place(last.points, last.normals)
    assert posture is not None
    return replace(last, posture=posture)


def collides(motion, fingers):
    triangles = triangles_of(SURFACE.points, SURFACE.network.faces)
    return collisions(
        HAND, triangles, motion.transform_palm_to_world, motion.joints, motion.closing, fingers
    ).any()


def test_a_way_that_is_clear_stays_as_it_was():
    last = held()
    history = [grasp_at([22, 142, 262], 0.1, through=1.1), last]
    paths = fingertip_paths(history, PLANNER.paths, PLANNER.floating_distance_m, HAND)
    before = track(paths, HAND, last.posture, PLANNER.paths)
    assert not collides(before, last.posture.fingers)
    _, motion = clear_approach(history, SURFACE, HAND, PLANNER)
    np.testing.assert_array_equal(motion.joints, before.joints)


def test_a_way_through_the_object_gives_way_to_a_clear_one():
    last = held()
    # The first configuration is far inside: the tips would have to come out through the surface.
    history = [grasp_at([30, 150, 270], 0.0, through=0.2), last]
    planner = replace(PLANNER, floating_distance_m=0.012)
    paths = fingertip_paths(history, planner.paths, planner.floating_distance_m, HAND)
    assert collides(track(paths, HAND, last.posture, planner.paths), last.posture.fingers)
    ways, motion = clear_approach(history, SURFACE, HAND, planner)
    assert not collides(motion, last.posture.fingers)
    for i, way in enumerate(ways):
        np.testing.assert_allclose(way.points[-1], last.points[i], atol=1e-12)


def test_a_tip_inside_the_object_is_a_collision_until_it_closes_on_its_contact():
    last = held()
    triangles = triangles_of(SURFACE.points, SURFACE.network.faces)
    pose = last.posture.transform_palm_to_world.copy()
    pose[0, 3] += 0.0008  # pushes one tip into the object
    poses, joints = pose[None], last.posture.joints[None]
    assert collisions(HAND, triangles, poses, joints, 1, last.posture.fingers).all()
    assert not collisions(HAND, triangles, poses, joints, 0, last.posture.fingers).any()


def test_the_ground_is_in_the_way_as_the_object_is():
    last = held()
    paths = fingertip_paths([last], PLANNER.paths, PLANNER.floating_distance_m, HAND)
    motion = track(paths, HAND, last.posture, PLANNER.paths)
    lowest = min(
        float((HAND.tip_positions(joints) @ pose[:3, :3].T + pose[:3, 3])[:, 2].min())
        for joints, pose in zip(motion.joints, motion.transform_palm_to_world, strict=True)
    )
    triangles = triangles_of(SURFACE.points, SURFACE.network.faces)

    def sunk(ground_m):
        return collisions(
            HAND, triangles, motion.transform_palm_to_world, motion.joints, motion.closing,
            last.posture.fingers, ground_m,
        ).any()  # fmt: skip

    # A tip's sphere reaches a radius below its centre; links are higher here.
    assert sunk(lowest - HAND.tip_radius_m + 0.002)
    assert not sunk(None)
    assert not sunk(lowest - 0.1)
