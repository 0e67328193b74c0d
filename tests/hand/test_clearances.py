"""Compiled clearances of postures against Coal, and sampled object points."""

import coal
import numpy as np
import pinocchio
import pytest

from graspbench.hand.collision import OBJECT_CAP_M, measure_clearances
from graspbench.hand.model import shape_poses
from graspbench.hand.obstacle import make_obstacle
from graspbench.hand.shapes import BOUND, FINGER, KIND, LINK, PALM, RADIUS
from graspbench.hand.task import Task, make_system

NOTHING = np.zeros((0, 3))
POSE = np.column_stack([np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 0.21)])


def measured(hand, joints, obstacle=NOTHING, height=0.0, pose=POSE):
    task = Task(
        NOTHING, NOTHING, NOTHING, make_obstacle(obstacle), np.array([height, 0.002, 0.001, 0.001, 0.016])
    )
    out = np.empty(3)
    system = make_system(hand.chains, hand.shapes)
    contact_of = np.full(hand.n_fingers, -1)
    measure_clearances(hand.chains, hand.shapes, task, contact_of, pose, hand.by_finger(joints), system, out)
    return out


def coal_clearance(hand, joints):
    """Smallest distance over the same pairs of bodies, with the URDF's own shapes."""
    model, data = hand.model, hand.model.createData()
    pinocchio.forwardKinematics(model, data, joints)
    at = {
        int(hand.chains.index[f, k]): (f, k)
        for f in range(hand.n_fingers)
        for k in range(hand.chains.counts[f])
    }
    index = [(int(r[FINGER]), int(r[LINK])) for r in hand.shapes.index]
    pairs = {frozenset((index[a], index[b])) for a, b in hand.shapes.pairs}
    items = [
        (
            at.get(model.joints[g.parentJoint].idx_q, (PALM, PALM)) if g.parentJoint else (PALM, PALM),
            g.geometry,
            data.oMi[g.parentJoint] * g.placement,
        )
        for g in hand.geometry.geometryObjects
    ]
    least = np.inf
    for i, (body_a, shape_a, pose_a) in enumerate(items):
        for body_b, shape_b, pose_b in items[:i]:
            if frozenset((body_a, body_b)) in pairs:
                at_a = coal.Transform3s(pose_a.rotation, pose_a.translation)
                at_b = coal.Transform3s(pose_b.rotation, pose_b.translation)
                result = coal.DistanceResult()
                least = min(
                    least, coal.distance(shape_a, at_a, shape_b, at_b, coal.DistanceRequest(), result)
                )
    return least


def test_clearance_within_the_hand_agrees_with_coal(hand):
    rng = np.random.default_rng(3)
    centre, seen = 0.5 * (hand.lower + hand.upper), 0
    for _ in range(60):
        joints = centre + rng.uniform(-0.4, 0.4, hand.n_joints) * (hand.upper - hand.lower)
        for f in range(hand.n_joints):
            if f not in hand.chains.index:
                joints[f] = hand.rest[f]
        expected, got = coal_clearance(hand, joints), measured(hand, joints)[1]
        # Capsules around the radial hand's rods enclose them, so the compiled clearance may be smaller.
        assert got <= min(expected, 0.05) + 1e-5 or expected < 0.0
        if expected > 0.0:
            seen += 1
            assert got >= min(expected, 0.05) - (1e-4 if hand.name != "radial" else 0.004)
        else:
            assert got <= 1e-5
    assert seen > 10


def test_clearance_to_the_ground_is_that_of_the_lowest_tip(radial):
    lowest = POSE[2, 3] - radial.tip_positions(radial.preferred)[:, 2].max() - radial.tip_radius_m
    for height in (0.0, 0.02, lowest + 0.005):
        assert measured(radial, radial.preferred, height=height)[0] == pytest.approx(
            min(lowest - height, 0.05), abs=1e-9
        )
    assert measured(radial, radial.preferred, height=-np.inf)[0] == 0.05


def test_clearance_to_object_points_is_the_smallest_signed_distance(hand):
    rng = np.random.default_rng(4)
    shapes = hand.shapes
    poses = shape_poses(hand.chains, shapes, hand.by_finger(hand.preferred))
    for _ in range(40):
        cloud = rng.uniform((-0.1, -0.1, -0.05), (0.1, 0.1, 0.15), (30, 3))
        local = (cloud - POSE[:, 3]) @ POSE[:, :3]
        expected = OBJECT_CAP_M
        for s in range(len(shapes.index)):
            if shapes.index[s, 3] == 1:
                continue
            offset = (local - poses[s][:, 3]) @ poses[s][:, :3]
            half = shapes.size[s, :3]
            if shapes.index[s, KIND] == 2:
                over = np.column_stack(
                    [np.hypot(offset[:, 0], offset[:, 1]) - half[0], abs(offset[:, 2]) - half[2]]
                )
            else:
                over = np.abs(offset) - half
            outside = np.linalg.norm(np.maximum(over, 0), axis=1)
            distance = np.where(outside > 0, outside, over.max(axis=1)) - shapes.size[s, RADIUS]
            expected = min(expected, distance.min())
        got = measured(hand, hand.preferred, cloud)[2]
        if expected > -0.001:
            assert got == pytest.approx(expected, abs=1e-9)
        else:
            assert got < -0.0005


def test_bounding_spheres_bound(hand):
    half, radius = hand.shapes.size[:, :3], hand.shapes.size[:, RADIUS]
    corner = np.linalg.norm(np.where(hand.shapes.index[:, [KIND]] == 2, half * (1, 0, 1), half), axis=1)
    np.testing.assert_allclose(hand.shapes.size[:, BOUND], corner + radius)
