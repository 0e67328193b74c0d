import dataclasses
from itertools import combinations

import numpy as np
import pinocchio
import pytest

from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.hand.coal_shapes import signed_distance
from graspbench.hand.verification import link_of_shapes
from graspbench.planning.barrier import (
    BarrierValues,
    KinematicBarrier,
    barrier_force,
    hyperbolic_barrier,
)
from graspbench.planning.index import contour_nodes
from graspbench.planning.parameters import BarrierParameters
from tests.planning.shapes import ellipsoid, lifted

HAND = load_hand(HandParameters(fingers=3))
SURFACE = lifted(ellipsoid((0.032, 0.036, 0.05)), 0.06)


@pytest.fixture(scope="module")
def grasp():
    arms = SURFACE.points - SURFACE.centroid
    arms = arms / np.linalg.norm(arms, axis=1, keepdims=True)
    angles = 2 * np.pi * np.arange(3) / 3
    vertices = np.argmax(arms @ np.array([np.cos(angles), np.sin(angles), 0 * angles]), axis=0)
    posture = GraspChecker(HAND).place(SURFACE.points[vertices], SURFACE.normals[vertices])
    assert posture is not None
    return vertices, posture


def barrier(ground_height_m=0.0, **parameters):
    return KinematicBarrier(HAND, ground_height_m, BarrierParameters(**parameters))


def test_hyperbola():
    assert hyperbolic_barrier(0.3, 0.1, 0.3, 2.0) == 0.0
    assert hyperbolic_barrier(0.2, 0.1, 0.3, 2.0) == pytest.approx(2.0)
    assert hyperbolic_barrier(0.1, 0.1, 0.3, 2.0) == np.inf
    assert hyperbolic_barrier(0.05, 0.1, 0.3, 2.0) == np.inf
    values = [hyperbolic_barrier(x, 0.1, 0.3, 2.0) for x in np.linspace(0.1001, 0.3, 100)]
    assert np.all(np.diff(values) < 0)
    # Continuous where it begins, and inversely proportional to the distance from the margin.
    assert hyperbolic_barrier(0.3 - 1e-9, 0.1, 0.3, 2.0) == pytest.approx(0.0, abs=1e-7)
    near, nearer = (
        hyperbolic_barrier(0.1 + 2e-6, 0.1, 0.3, 2.0),
        hyperbolic_barrier(0.1 + 1e-6, 0.1, 0.3, 2.0),
    )
    assert nearer == pytest.approx(2 * near, rel=1e-4)


def test_force_is_the_sum_of_repulsions_from_the_contour_points():
    points = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.02, 0], [-0.01, 0, 0]])
    nodes = np.array([[0, 1, 2, -1], [3, 0, -1, -1]])
    values = np.array([[5.0, 2.0, 3.0, 9.0], [0.0, 0.0, 0.0, 0.0]])
    np.testing.assert_allclose(barrier_force(points, nodes, values), [[-2.0, -3.0, 0.0], [0.0, 0.0, 0.0]])


def test_force_has_the_size_of_the_repulsion_wherever_the_contact_is():
    points = np.array([[0.3, -0.2, 0.5], [0.33, -0.16, 0.5]])
    force = barrier_force(points, np.array([[0, 1]]), np.array([[0.0, 2.0]]))
    np.testing.assert_allclose(force, [[-1.2, -1.6, 0.0]])


def test_total_is_the_sum_of_three_terms():
    terms = (np.array([[0.0, value]]) for value in (1.0, 2.0, 4.0))
    values = BarrierValues(np.array([[0, 1]]), *terms, np.ones((1, 2), dtype=bool))
    np.testing.assert_allclose(values.total, [[0.0, 7.0]])


def test_comfortable_grasp_feels_no_barrier(grasp):
    vertices, posture = grasp
    values = barrier(joint_margin=0.011, singular_value_m=0.0041, clearance_m=0.0021).values(
        SURFACE, vertices, posture
    )
    assert values.reachable[values.nodes >= 0].all()
    np.testing.assert_array_equal(values.total, 0.0)


def test_terms_are_those_of_the_finger_solved_at_each_contour_point(grasp):
    vertices, posture = grasp
    parameters = BarrierParameters(joint_margin=0.45, singular_value_m=0.06, clearance_m=0.03, strength_n=1.0)
    values = KinematicBarrier(HAND, 0.0, parameters).values(SURFACE, vertices, posture)
    np.testing.assert_array_equal(values.nodes, contour_nodes(SURFACE, vertices))
    to_world = posture.transform_palm_to_world
    assert (values.joint > 0).any()
    assert (values.singularity > 0).any()
    for i, finger in enumerate(posture.fingers):
        targets = SURFACE.points[values.nodes[i]] + HAND.tip_radius_m * SURFACE.normals[values.nodes[i]]
        targets = (targets - to_world[:3, 3]) @ to_world[:3, :3]
        start = posture.joints[HAND.finger_joints(finger)]
        solved = HAND.finger_ik(finger, targets, start, centring=0.02)
        assert values.reachable[i].all()
        expected = [hyperbolic_barrier(m, HAND.margins.joint, 0.45, 1.0) for m in solved.joint_margin]
        np.testing.assert_allclose(values.joint[i], expected, rtol=1e-6, atol=1e-9)
        expected = [
            hyperbolic_barrier(s, HAND.margins.singular_value_m, 0.06, 1.0)
            for s in solved.smallest_singular_value
        ]
        np.testing.assert_allclose(values.singularity[i], expected, rtol=1e-6, atol=1e-9)


def test_clearance_term_is_that_of_the_nearest_pair_of_links(grasp):
    vertices, posture = grasp
    parameters = BarrierParameters(clearance_m=0.049, strength_n=1.0)
    values = KinematicBarrier(HAND, None, parameters).values(SURFACE, vertices, posture)
    least = max(HAND.margins.hand_m, HAND.margins.ground_m)
    strongest = values.clearance[:, 0].max()
    nearest = least + (0.049 - least) / (1.0 + strongest)
    # Coal's distances between the links of different bodies; the compiled shapes are a little fatter.
    assert nearest == pytest.approx(coal_clearance(HAND, posture.joints), abs=2e-3)
    assert nearest == pytest.approx(posture.clearance_m, abs=1e-5)


def coal_clearance(hand, joints):
    data = hand.model.createData()
    pinocchio.forwardKinematics(hand.model, data, joints)
    items = hand.geometry.geometryObjects
    placed = [data.oMi[item.parentJoint] * item.placement for item in items]
    bodies = link_of_shapes(hand)
    pairs = {
        frozenset((tuple(hand.shapes.index[a, :2]), tuple(hand.shapes.index[b, :2])))
        for a, b in hand.shapes.pairs
    }
    return min(
        signed_distance(items[a].geometry, placed[a], items[b].geometry, placed[b])
        for a, b in combinations(range(len(items)), 2)
        if frozenset((bodies[a], bodies[b])) in pairs
    )


def test_ground_repels_what_comes_near_it(grasp):
    vertices, posture = grasp
    free = barrier(None).values(SURFACE, vertices, posture).clearance
    lowest_tip = SURFACE.points[vertices, 2].min() - 2 * HAND.tip_radius_m
    # The ground is raised to 4 mm below the lowest fingertip there is.
    close = barrier(lowest_tip + HAND.tip_radius_m - 0.004).values(SURFACE, vertices, posture)
    assert close.clearance[close.reachable].sum() > free.sum()
    force = barrier_force(SURFACE.points, close.nodes, close.clearance)
    assert force[:, 2].max() > 0.0
    assert force[:, 2].min() >= -1e-9


def test_points_below_the_ground_are_not_reachable(grasp):
    vertices, posture = grasp
    height = float(SURFACE.points[vertices, 2].max()) - HAND.tip_radius_m
    values = barrier(height).values(SURFACE, vertices, posture)
    lowest = SURFACE.points[values.nodes, 2] - HAND.tip_radius_m
    assert not values.reachable[lowest < height].any()


def test_unreachable_points_are_no_moves(grasp):
    vertices, posture = grasp
    moved = posture.transform_palm_to_world.copy()
    moved[:3, 3] -= 0.5 * moved[:3, 2]
    far = dataclasses.replace(posture, transform_palm_to_world=moved)
    moves = barrier().moves(SURFACE, vertices, far)
    np.testing.assert_array_equal(moves.nodes[:, 0], vertices)
    np.testing.assert_array_equal(moves.nodes[:, 1:], -1)


def test_without_a_posture_every_contour_point_is_a_move(grasp):
    vertices, _ = grasp
    finder = barrier()
    np.testing.assert_array_equal(
        finder.moves(SURFACE, vertices, None).nodes, contour_nodes(SURFACE, vertices)
    )
    assert finder.evaluations == 0


def test_evaluations_are_counted(grasp):
    vertices, posture = grasp
    finder = barrier()
    moves = finder.moves(SURFACE, vertices, posture)
    assert finder.evaluations == (contour_nodes(SURFACE, vertices) >= 0).sum()
    assert moves.barrier.shape == moves.nodes.shape
