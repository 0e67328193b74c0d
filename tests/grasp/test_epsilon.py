"""The ball in the wrench space against brute force, in closed form, and under motions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from graspbench.grasp import grasp_quality, is_force_closure
from graspbench.grasp.contact import contact_polytope
from graspbench.grasp.epsilon import smallest_support
from graspbench.grasp.wrench import wrench_maps
from tests.grasp.random_grasps import MODELS, SPACES, measured, random_grasp
from tests.oracles.wrench_hull import ball_by_hull, ball_by_subsets, closure_by_lp, corner_wrenches

CENTRE = np.zeros(3)


def _ring(count, radius=1.0):
    angles = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("model", MODELS)
def test_ball_and_closure_equal_brute_force(model, space):
    rng = np.random.default_rng(7)
    closed = 0
    for _ in range(12):
        grasp = random_grasp(rng, model, space)
        contacts = corner_wrenches(*grasp, model, space, 0.6, 3, 0.2, 1.3)
        quality, closure = measured(grasp, model, space, edges=3)
        many = model in ("soft_finger", "soft_pad") and space == "spatial"
        expected = ball_by_hull(contacts, False) if many else ball_by_subsets(contacts)
        assert quality.q3 == pytest.approx(expected, abs=1e-9)
        assert closure == (expected > 1e-9) == closure_by_lp(contacts)
        closed += closure
    assert closed > 0 or (space == "spatial" and model == "frictionless")


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("model", ["frictionless", "hard_finger"])
def test_ball_of_the_sum_equals_qhull(model, space):
    rng = np.random.default_rng(8)
    for _ in range(6):
        grasp = random_grasp(rng, model, space)
        contacts = corner_wrenches(*grasp, model, space, 0.6, 3, 0.2, 1.3)
        quality, _ = measured(grasp, model, space, edges=3, norm="linf")
        assert quality.q3 == pytest.approx(ball_by_hull(contacts, True), abs=1e-9)


def test_eight_edges_equal_qhull():
    rng = np.random.default_rng(9)
    for _ in range(5):
        grasp = random_grasp(rng, "hard_finger", "spatial")
        contacts = corner_wrenches(*grasp, "hard_finger", "spatial", 0.6, 8, 0.2, 1.3)
        quality, _ = measured(grasp, "hard_finger", "spatial", edges=8)
        assert quality.q3 == pytest.approx(ball_by_hull(contacts, False), abs=1e-9)


@pytest.mark.parametrize("radius", [0.3, 1.0, 2.0])
def test_three_hard_contacts_round_a_sphere(radius):
    points = _ring(3, radius)
    quality = grasp_quality(points, -points, CENTRE)
    assert quality.q1 == pytest.approx(min(np.sqrt(3.0), radius * np.sqrt(1.5)), abs=1e-12)
    assert quality.q2 == pytest.approx(13.5 * radius**3, rel=1e-12)
    assert is_force_closure(points, -points, CENTRE)


def test_frictionless_triple_in_the_plane_holds_half_a_force():
    points = _ring(3)
    kinds = {"contact": "frictionless", "wrench_space": "planar_force"}
    assert grasp_quality(points, -points, CENTRE, **kinds).q3 == pytest.approx(0.5, abs=1e-12)
    # its moments are all zero: with them there is no closure
    assert grasp_quality(points, -points, CENTRE, contact="frictionless", wrench_space="planar").q3 == 0.0


def test_frictionless_tetrahedron_holds_a_third_of_a_force():
    points = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
    quality = grasp_quality(points, -points, CENTRE, contact="frictionless", wrench_space="spatial_force")
    assert quality.q3 == pytest.approx(1.0 / 3.0, abs=1e-12)
    assert quality.q1 == pytest.approx(2.0 / np.sqrt(3.0), abs=1e-12)


def test_antipodal_pair_of_hard_fingers_turns_about_its_axis_soft_ones_do_not():
    points = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert grasp_quality(points, -points, CENTRE).q3 == 0.0
    assert not is_force_closure(points, -points, CENTRE)
    assert is_force_closure(points, -points, CENTRE, contact="soft_finger")
    assert is_force_closure(points, -points, CENTRE, wrench_space="planar")
    # with every force of unit normal part, the moment about the axis is the weakest direction
    soft = grasp_quality(points, -points, CENTRE, contact="soft_finger", torsional_friction=0.05)
    assert 0.0 < soft.q3 <= 0.05 + 1e-12


def test_cross_polytope_holds_one_over_root_six():
    wrenches = np.concatenate([np.eye(6), -np.eye(6)])[None, :, None, :]
    found = smallest_support(wrenches, contact_polytope("frictionless"))
    assert found[0] == pytest.approx(1.0 / np.sqrt(6.0), abs=1e-12)


def test_contacts_on_one_side_do_not_close():
    points = _ring(3)
    inward = np.tile([1.0, 0.0, 0.0], (3, 1))
    for space in SPACES:
        quality = grasp_quality(points, inward, CENTRE, wrench_space=space)
        assert quality.q3 == 0.0
        assert not is_force_closure(points, inward, CENTRE, wrench_space=space)


def test_a_batch_equals_its_grasps_one_by_one():
    rng = np.random.default_rng(3)
    grasps = [g for g in (random_grasp(rng, "hard_finger", "spatial") for _ in range(30)) if len(g[0]) == 3]
    points, normals = (np.stack([g[k] for g in grasps]) for k in (0, 1))
    batch = grasp_quality(points, normals, CENTRE)
    for k in range(len(grasps)):
        one = grasp_quality(points[k], normals[k], CENTRE)
        assert (batch.q1[k], batch.q2[k], batch.q3[k]) == pytest.approx(one, abs=1e-12)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.floats(0.01, 100.0))
def test_motions_and_scale_change_nothing(seed, scale):
    rng = np.random.default_rng(seed)
    points, normals, _ = random_grasp(rng, "hard_finger", "spatial")
    turn, shift = Rotation.random(random_state=seed).as_matrix(), rng.standard_normal(3)
    before = grasp_quality(points, normals, CENTRE, torque_length=1.2)
    after = grasp_quality(scale * points @ turn.T + shift, normals @ turn.T, shift, torque_length=1.2 * scale)
    assert tuple(after) == pytest.approx(tuple(before), abs=1e-9)


@pytest.mark.parametrize("count", [3, 4, 5])
@pytest.mark.parametrize("edges", [3, 4])
def test_regular_grasps_with_flat_facets_of_many_corners_equal_qhull(count, edges):
    points = _ring(count)
    tangents = np.tile([0.0, 0.0, 1.0], (count, 1))
    grasp = points, -points, tangents
    contacts = corner_wrenches(*grasp, "hard_finger", "spatial", 0.6, edges, 0.2, 1.3)
    quality, closure = measured(grasp, "hard_finger", "spatial", edges=edges)
    assert closure
    assert quality.q3 == pytest.approx(ball_by_hull(contacts, False), abs=1e-9)


def _mirrored(rng, count):
    """Contacts in a box's faces, each one twice or opposite to another."""
    axis, side = int(rng.integers(3)), 1.0
    points, inward = np.zeros((count, 3)), np.zeros((count, 3))
    for k in range(count):
        if k % 2 == 0:
            points[k] = rng.choice([-0.5, 0.0, 0.5], 3)
            axis = int(rng.integers(3))
        else:
            points[k] = points[k - 1]
        side = float(rng.choice([-1.0, 1.0]))
        points[k, axis], inward[k, axis] = side, -side
    tangents = np.roll(inward, 1, axis=1)
    return points, inward, tangents


@pytest.mark.parametrize("edges", [4, 6, 8])
@pytest.mark.parametrize("count", [2, 3, 4])
def test_box_grasps_with_mirrored_and_repeated_contacts_equal_qhull(count, edges):
    rng = np.random.default_rng(10 * count + edges)
    for _ in range(12):
        grasp = _mirrored(rng, count)
        contacts = corner_wrenches(*grasp, "hard_finger", "spatial", 0.5, edges, 0.2, 1.0)
        quality, closure = measured(
            grasp, "hard_finger", "spatial", friction=0.5, edges=edges, torque_length=1.0
        )
        expected = ball_by_hull(contacts, False)
        assert quality.q3 == pytest.approx(expected, abs=1e-9)
        assert closure == (expected > 1e-9)


def test_two_hard_fingers_never_close():
    rng = np.random.default_rng(11)
    for edges in (5, 6, 8):
        for friction in (0.5, 1.0):
            first = rng.standard_normal(3)
            points = np.stack([first, -first]) / np.linalg.norm(first)
            assert not is_force_closure(points, -points, CENTRE, friction=friction, cone_edges=edges)
            quality = grasp_quality(points, -points, CENTRE, friction=friction, cone_edges=edges)
            assert quality.q3 == 0.0


def test_stopping_early_gives_an_upper_bound():
    points = np.stack([_ring(3), _ring(3, 2.0)])
    polytope = contact_polytope("hard_finger", 0.5, 4)
    maps = wrench_maps(points, -_ring(3)[None].repeat(2, axis=0), CENTRE)
    wrenches = polytope.vertices @ np.swapaxes(maps, -1, -2)
    least = smallest_support(wrenches, polytope)
    for share in (0.5, 0.99, 1.01, 3.0):
        found = smallest_support(wrenches, polytope, stop_at=share * least.min())
        assert np.all(found >= least - 1e-12)
        assert np.all((found == least) | (found <= share * least.min()))
