"""What spares work when a hand is read changes nothing of what is found."""

from itertools import combinations

import coal
import numpy as np
import pinocchio

from graspbench.hand.distance import core_distance
from graspbench.hand.shapes import BOUND, FINGER, KIND, LINK, PALM, RADIUS, with_pairs
from graspbench.hand.verification import overlaps
from tests.hand.conftest import random_joints


def test_pairs_are_those_of_all_distances(hand):
    rng = np.random.default_rng(3)
    drawn = [shape_rows(hand, random_joints(hand, rng)) for _ in range(5)]
    preferred = shape_rows(hand, hand.preferred)
    found = {tuple(pair) for pair in with_pairs(hand.shapes, preferred, drawn).pairs.tolist()}
    assert found == pairs_by_all_distances(hand.shapes, preferred, drawn)


def test_overlaps_are_those_of_all_pairs(hand):
    rng = np.random.default_rng(5)
    found = [overlaps(hand, random_joints(hand, rng)) for _ in range(6)]
    rng = np.random.default_rng(5)
    assert [len(each) for each in found] == [overlaps_of_all(hand, random_joints(hand, rng)) for _ in found]
    assert any(found)


def shape_rows(hand, joints):
    """Return the poses of a hand's shapes, palm frame, by Pinocchio."""
    data = hand.model.createData()
    pinocchio.forwardKinematics(hand.model, data, joints)
    palm = pinocchio.SE3(hand.transform_palm_to_root).inverse()
    poses = hand.shapes.local.copy()
    for s, (finger, link) in enumerate(hand.shapes.index[:, :2]):
        if finger == PALM:
            continue
        frame = palm * data.oMi[hand.chain_joints[finger][link]] * pinocchio.SE3(turned(hand, finger, link))
        local = pinocchio.SE3(hand.shapes.local[s, :, :3], hand.shapes.local[s, :, 3])
        poses[s] = (frame * local).homogeneous[:3]
    return poses


def turned(hand, finger, link):
    """Return how the compiled chain's joint frame, whose axis is z, is turned in Pinocchio's."""
    joint = hand.chain_joints[finger][link]
    axis = hand.model.joints[joint].shortname()[-1]
    turn = np.eye(4)
    if axis == "X":
        turn[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    elif axis == "Y":
        turn[:3, :3] = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    return turn


def pairs_by_all_distances(shapes, preferred, drawn):
    bodies = [(int(row[FINGER]), int(row[LINK])) for row in shapes.index]

    def meet(rows, a, b):
        radii = float(shapes.size[a, RADIUS] + shapes.size[b, RADIUS])
        kinds = shapes.index[:, KIND]
        gap = core_distance(kinds[a], rows[a], shapes.size[a], kinds[b], rows[b], shapes.size[b], radii)
        return gap[0] < radii + 1e-6

    candidates, belong = [], set()
    for a, b in combinations(range(len(bodies)), 2):
        related = bodies[a][0] == bodies[b][0] or PALM in (bodies[a][0], bodies[b][0])
        if related and abs(bodies[a][1] - bodies[b][1]) <= 1:
            continue
        candidates.append((a, b))
        often = sum(meet(rows, a, b) for rows in drawn)
        if related and (meet(preferred, a, b) or 2 * often > len(drawn)):
            belong.add((bodies[a], bodies[b]))
    return {(a, b) for a, b in candidates if (bodies[a], bodies[b]) not in belong}


def overlaps_of_all(hand, joints):
    """Count overlaps of more than 0.1 mm among all pairs of shapes whose links are checked."""
    data, placed = hand.model.createData(), hand.geometry.createData()
    pinocchio.updateGeometryPlacements(hand.model, data, hand.geometry, placed, joints)
    bodies = [(int(row[FINGER]), int(row[LINK])) for row in hand.shapes.index]
    checked = {frozenset((bodies[a], bodies[b])) for a, b in hand.shapes.pairs}
    at = {joint: (f, k) for f, chain in enumerate(hand.chain_joints) for k, joint in enumerate(chain)}
    items, count = hand.geometry.geometryObjects, 0
    for a, b in combinations(range(len(items)), 2):
        own = frozenset(at.get(items[i].parentJoint, (PALM, PALM)) for i in (a, b))
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        request.enable_signed_distance = True
        poses = [coal.Transform3s(placed.oMg[i].rotation, placed.oMg[i].translation) for i in (a, b)]
        depth = -coal.distance(items[a].geometry, poses[0], items[b].geometry, poses[1], request, result)
        count += own in checked and depth > 1e-4
    return count


def test_bounds_hold_the_shapes(hand):
    assert np.all(hand.shapes.size[:, BOUND] >= hand.shapes.size[:, RADIUS])
