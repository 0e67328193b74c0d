"""Every term against hand-made configurations and against the gradient of the potential it stands for."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.errors import ConfigurationError
from graspbench.planning.barrier import barrier_force
from graspbench.planning.field import mean_radius
from graspbench.planning.grip_plane import grip_geometry
from graspbench.planning.index import INDICES, Moves, contour_nodes, free_moves, make_index
from graspbench.planning.indices.force_field import (
    ForceField,
    ForceFieldParameters,
    field_forces,
    field_potential,
)
from tests.planning.shapes import ellipsoid, radial

PURE = {"k_pi": 0.0, "k_cm": 0.0, "k_e": 0.0, "k_a": 0.0}
SI = {"length_unit_m": 1.0, "angle_unit_deg": float(np.rad2deg(1.0))}


def only(**coefficients):
    return ForceFieldParameters(**{**PURE, **SI, **coefficients})


def star(angles_deg, radius=0.04, height=0.0):
    angles = np.deg2rad(angles_deg)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(len(angles), height)])


def forces(points, centroid=(0, 0, 0), normals=None, **coefficients):
    points = np.asarray(points, dtype=float)
    normals = np.zeros_like(points) if normals is None else normals
    return field_forces(points, normals, np.asarray(centroid, dtype=float), only(**coefficients))


def test_plane_term_pulls_a_raised_contact_down_and_its_neighbours_up():
    points = star([0, 90, 180, 270])
    points[:, 2] = [0.004, -0.004, 0.004, -0.004]
    found = forces(points, k_pi=2.0).plane
    np.testing.assert_allclose(found[:, 2], [-0.008, 0.008, -0.008, 0.008], atol=1e-15)
    np.testing.assert_allclose(found[:, :2], 0.0, atol=1e-15)


def test_centroid_term_pulls_every_contact_to_the_side_of_the_centroid():
    found = forces(star([0, 120, 240], height=0.01), centroid=[0.0, 0.0, 0.03], k_cm=3.0).centroid
    np.testing.assert_allclose(found, np.tile([0.0, 0.0, 3 * 0.02], (3, 1)), atol=1e-15)


def test_no_centroid_term_without_its_coefficient():
    found = forces(star([0, 120, 240], height=0.01), centroid=[0.0, 0.0, 0.03], k_pi=1.0, k_e=1.0, k_a=1.0)
    np.testing.assert_array_equal(found.centroid, 0.0)


def test_equilateral_term_follows_the_next_contact_when_it_is_too_far():
    # From contact 0 to contact 1 there are 140 degrees: 20 too many.
    found = forces(star([0, 140, 260]), k_e=2.0).equilateral
    np.testing.assert_allclose(found[0], [0.0, 2.0 * np.deg2rad(20), 0.0], atol=1e-12)
    np.testing.assert_allclose(found[1], 0.0, atol=1e-12)
    # From contact 2 on to contact 0 there are 100 degrees: it backs away, clockwise.
    tangent = np.array([-np.sin(np.deg2rad(260)), np.cos(np.deg2rad(260)), 0.0])
    np.testing.assert_allclose(found[2], 2.0 * np.deg2rad(-20) * tangent, atol=1e-12)


def test_equilateral_term_does_not_depend_on_the_sense_in_which_contacts_are_numbered():
    points = star([0, 140, 260])
    found = forces(points[::-1].copy(), k_e=1.0).equilateral[::-1]
    # Now contact 1 is followed by contact 0, 140 degrees away: it is pulled towards it.
    assert found[1] @ (points[0] - points[1]) > 0.0
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), np.deg2rad([20, 20, 0]), atol=1e-12)


def test_area_term_pushes_straight_outwards_with_unit_force():
    found = forces(star([0, 90, 210]), k_a=1.5).area
    np.testing.assert_allclose(found, 1.5 * star([0, 90, 210], radius=1.0), atol=1e-12)


def test_projection_leaves_the_tangential_part_of_the_sum():
    points = star([0, 110, 250], height=0.01)
    normals = star([0, 120, 240], radius=1.0)
    barrier = np.tile([0.1, 0.0, 0.2], (3, 1))
    parameters = ForceFieldParameters(k_b=3.0)
    found = field_forces(points, normals, np.zeros(3), parameters, barrier)
    np.testing.assert_allclose(found.barrier, 3 * barrier)
    np.testing.assert_allclose((found.projected * normals).sum(axis=1), 0.0, atol=1e-12)
    rest = found.total - found.projected
    np.testing.assert_allclose(np.cross(rest, normals), 0.0, atol=1e-12)
    np.testing.assert_allclose(
        found.total, found.plane + found.centroid + found.equilateral + found.area + found.barrier
    )


def test_default_units_make_a_millimetre_and_a_degree_weigh_as_much_as_the_push_outwards():
    points = star([0, 121, 240], height=0.001)
    found = field_forces(points, np.zeros((3, 3)), np.zeros(3), ForceFieldParameters())
    assert np.linalg.norm(found.centroid[0]) == pytest.approx(1.0)
    assert np.linalg.norm(found.equilateral[0]) == pytest.approx(1.0)
    assert np.linalg.norm(found.area[0]) == pytest.approx(1.0)


def gradient(points, centroid, parameters, radius=0.04):
    found = np.zeros_like(points)
    for i in range(len(points)):
        for a in range(3):
            step = np.zeros_like(points)
            step[i, a] = 1e-7
            up = field_potential(points + step, centroid, radius, parameters)
            down = field_potential(points - step, centroid, radius, parameters)
            found[i, a] = (up - down) / 2e-7
    return found


@pytest.mark.parametrize("n_f", [3, 4, 5])
def test_plane_and_area_terms_are_minus_the_gradient_of_their_potential(n_f):
    rng = np.random.default_rng(n_f)
    points = star(360 * np.arange(n_f) / n_f) + 0.002 * rng.normal(size=(n_f, 3))
    parameters = only(k_pi=1.0)
    np.testing.assert_allclose(
        forces(points, k_pi=1.0).plane, -gradient(points, np.zeros(3), parameters), atol=1e-8
    )
    flat = star([0, 100, 200])[:, :] if n_f == 3 else star(360 * np.arange(n_f) / n_f)
    pushed = -gradient(flat, np.zeros(3), only(k_a=1.0))
    np.testing.assert_allclose(forces(flat, k_a=1.0).area, pushed, atol=1e-6)


def test_centroid_term_does_the_work_of_its_potential_when_the_plane_is_shifted():
    points, centroid = star([0, 110, 250], height=0.01), np.array([0.001, 0.002, -0.004])
    shift = np.array([0.0, 0.0, 1e-6])
    parameters = only(k_cm=1.0)
    gained = field_potential(points - shift, centroid, 0.04, parameters) - field_potential(
        points + shift, centroid, 0.04, parameters
    )
    work = (forces(points, centroid, k_cm=1.0).centroid @ shift).sum()
    assert gained / 2 == pytest.approx(work, rel=1e-6)


def test_equilateral_term_lowers_its_potential():
    rng = np.random.default_rng(5)
    for n_f in (2, 3, 4, 5):
        for _ in range(20):
            angles = 360 * np.arange(n_f) / n_f + rng.uniform(-20, 20, n_f)
            points = star(angles)
            pull = forces(points, k_e=1.0).equilateral
            before = field_potential(points, np.zeros(3), 0.04, only(k_e=1.0))
            after = field_potential(points + 1e-5 * pull, np.zeros(3), 0.04, only(k_e=1.0))
            assert after < before


def potential_by_definition(points, centroid, radius, k):
    """The potential, J, by projection on the plane that fits best; contacts in cyclic order."""
    mean = points.mean(axis=0)
    normal = np.linalg.svd(points - mean)[2][2]
    heights = (points - mean) @ normal
    flat = points - np.outer(heights, normal)
    offset = (centroid - mean) @ normal
    arms = flat - (centroid - offset * normal)
    following = np.roll(arms, -1, axis=0)
    angles = np.arctan2(np.cross(arms, following) @ normal, np.sum(arms * following, axis=1))
    if angles.sum() < 0.0:
        angles = -angles
    n_f = len(points)
    return (
        0.5 * k["k_pi"] * np.sum(heights**2)
        + 0.5 * n_f * k["k_cm"] * offset**2
        + 0.25 * radius * k["k_e"] * np.sum((angles % (2 * np.pi) - 2 * np.pi / n_f) ** 2)
        - k["k_a"] * np.linalg.norm(arms, axis=1).sum()
    )


@pytest.mark.parametrize("n_f", [3, 4, 5])
def test_potential_of_tilted_contacts_around_a_centroid_that_is_nowhere_special(n_f):
    rng = np.random.default_rng(n_f)
    for _ in range(20):
        turn = Rotation.random(random_state=rng)
        centroid = rng.uniform(-0.2, 0.2, 3)
        star_points = star(360 * np.arange(n_f) / n_f + rng.uniform(-20, 20, n_f), height=0.01)
        points = turn.apply(star_points + 0.004 * rng.normal(size=(n_f, 3))) + centroid
        k = dict(zip(("k_pi", "k_cm", "k_e", "k_a"), rng.uniform(0.5, 2.0, 4), strict=True))
        parameters = only(**k)
        assert field_potential(points, centroid, 0.05, parameters) == pytest.approx(
            potential_by_definition(points, centroid, 0.05, k), rel=1e-9
        )


def climb(index, surface, vertices):
    for _ in range(300):
        proposed = index.propose(surface, vertices, free_moves(surface, vertices))
        if proposed is None:
            return vertices
        vertices = proposed
    pytest.fail("the force field does not come to rest")


def near(surface, directions):
    arms = surface.points - surface.centroid
    arms = arms / np.linalg.norm(arms, axis=1, keepdims=True)
    return np.argmax(arms @ np.asarray(directions, dtype=float).T, axis=0)


def lopsided(d):
    return 0.04 * (1 + 0.25 * d[:, 0] ** 2 + 0.3 * np.maximum(0, d[:, 2]) ** 3 + 0.1 * d[:, 1])


@pytest.mark.parametrize("n_f", [2, 3, 4, 5])
@pytest.mark.parametrize("k_cm", [0.0, 1.0])
def test_comes_to_rest_in_a_local_optimum(n_f, k_cm):
    surface = radial(lopsided)
    index = ForceField(ForceFieldParameters(k_cm=k_cm), n_f)
    angles = 2 * np.pi * np.arange(n_f) / n_f + 0.2
    start = near(surface, np.column_stack([np.cos(angles), np.sin(angles), np.full(n_f, 0.5)]))
    end = climb(index, surface, start)
    assert index.score(surface, end) > index.score(surface, start)
    assert index.propose(surface, end, free_moves(surface, end)) is None
    for i in range(n_f):
        for node in surface.network.contour(int(end[i])):
            other = end.copy()
            other[i] = node
            if len(set(other)) == n_f:
                assert index.score(surface, other) <= index.score(surface, end) + 1e-6


@pytest.mark.parametrize("n_f", [3, 4])
def test_grasp_is_equilateral_and_its_plane_holds_the_centroid(n_f):
    surface = radial(lopsided, meridians=48)
    angles = 2 * np.pi * np.arange(n_f) / n_f + 0.3
    start = near(surface, np.column_stack([np.cos(angles), np.sin(angles), np.full(n_f, 0.6)]))
    end = climb(ForceField(ForceFieldParameters(), n_f), surface, start)
    found = grip_geometry(surface.points[end], surface.centroid)
    assert found.equilateral_error_deg < 3.0
    assert found.plane_offset_m < 2e-3


def test_polygon_grows_when_the_plane_is_freed_from_the_centroid():
    # A club, whose widest place is above its centroid.
    surface = radial(
        lambda d: 0.03 * (1 + 2 * np.maximum(0, d[:, 2]) ** 4 + 0.6 * np.maximum(0, -d[:, 2]) ** 2)
    )
    start = near(surface, [[1, 0, 0], [-0.5, 0.866, 0], [-0.5, -0.866, 0]])
    areas = {}
    for k_cm in (0.0, 1.0):
        end = climb(ForceField(ForceFieldParameters(k_cm=k_cm, rest="potential"), 3), surface, start)
        areas[k_cm] = grip_geometry(surface.points[end], surface.centroid).area_m2
    assert areas[0.0] > 1.05 * areas[1.0]


@pytest.mark.parametrize("rest", ["balance", "potential", "single"])
def test_compiled_climb_takes_the_same_way_as_proposals(rest):
    surface = radial(lopsided)
    index = ForceField(ForceFieldParameters(rest=rest), 3)
    start = near(surface, [[1, 0, 0.4], [-0.5, 0.866, 0.4], [-0.5, -0.866, 0.4]])
    everywhere = np.ones(len(surface.points), dtype=np.bool_)
    path = index.climb_all(surface, start[None], everywhere, thorough=True, max_moves=300).path(0)
    vertices = start
    for expected in path[1:]:
        vertices = index.propose(surface, vertices, free_moves(surface, vertices))
        np.testing.assert_array_equal(vertices, expected)
    assert index.propose(surface, vertices, free_moves(surface, vertices)) is None


@pytest.mark.parametrize("rest", ["balance", "potential", "single"])
@pytest.mark.parametrize("max_moves", [3, 300])
def test_many_grasps_climb_as_each_would_alone(rest, max_moves):
    surface = radial(lopsided)
    index = ForceField(ForceFieldParameters(rest=rest), 3)
    everywhere = np.ones(len(surface.points), dtype=np.bool_)
    rng = np.random.default_rng(0)
    starts = np.array([rng.choice(len(surface.points), 3, replace=False) for _ in range(12)])
    # A start on another one's way: the two ways are one from there on.
    alone = [
        index.climb_all(surface, start[None], everywhere, thorough=True, max_moves=max_moves)
        for start in starts
    ]
    starts = np.vstack((starts, alone[0].paths[1], starts[3]))
    alone += [
        index.climb_all(surface, start[None], everywhere, thorough=True, max_moves=max_moves)
        for start in starts[12:]
    ]
    together = index.climb_all(surface, starts, everywhere, thorough=True, max_moves=max_moves)
    assert len(together.first) == len(starts) + 1
    for rank, one in enumerate(alone):
        np.testing.assert_array_equal(together.path(rank), one.paths)
        np.testing.assert_array_equal(together.ends[rank], one.paths[-1])
    scores = index.scores(surface, together.ends)
    np.testing.assert_array_equal(scores, [index.score(surface, end) for end in together.ends])


def test_climb_stays_on_allowed_nodes():
    surface = radial(lopsided)
    index = ForceField(ForceFieldParameters(k_cm=0.0), 3)
    allowed = surface.points[:, 2] > 0.0
    start = near(surface, [[1, 0, 0.4], [-0.5, 0.866, 0.4], [-0.5, -0.866, 0.4]])
    path = index.climb_all(surface, start[None], allowed, thorough=True, max_moves=300).path(0)
    assert len(path) > 1
    assert allowed[path].all()


def test_forces_below_the_threshold_do_not_move_a_contact():
    surface = ellipsoid((0.03, 0.045, 0.08), at_rest=False)
    start = near(surface, [[1, 0, 0.4], [-0.5, 0.866, 0.4], [-0.5, -0.866, 0.4]])
    assert (
        ForceField(ForceFieldParameters(), 3).propose(surface, start, free_moves(surface, start)) is not None
    )
    lazy = ForceField(ForceFieldParameters(sigma_f=1e3), 3)
    assert lazy.propose(surface, start, free_moves(surface, start)) is None


def test_only_allowed_moves_are_proposed():
    surface = radial(lopsided)
    index = ForceField(ForceFieldParameters(), 3)
    start = near(surface, [[1, 0, 0.4], [-0.5, 0.866, 0.4], [-0.5, -0.866, 0.4]])
    moves = free_moves(surface, start)
    nodes = moves.nodes.copy()
    nodes[0, 1:] = -1
    nodes[1, 3:] = -1
    proposed = index.propose(surface, start, Moves(nodes, moves.barrier, moves.barrier_force))
    assert proposed[0] == start[0]
    assert all(node in row for node, row in zip(proposed, nodes, strict=True))


def test_barrier_turns_a_contact_away():
    surface = radial(lopsided)
    index = ForceField(ForceFieldParameters(), 3)
    start = near(surface, [[1, 0, 0.4], [-0.5, 0.866, 0.4], [-0.5, -0.866, 0.4]])
    free = index.propose(surface, start, free_moves(surface, start))
    finger = int(np.flatnonzero(free != start)[0])
    nodes = contour_nodes(surface, start)
    barrier = np.zeros(nodes.shape)
    barrier[finger, nodes[finger] == free[finger]] = 1e3
    proposed = index.propose(surface, start, Moves(nodes, barrier, np.zeros((3, 3))))
    assert proposed is None or proposed[finger] != free[finger]


def test_barrier_alone_drives_a_contact_away_from_what_repels_it():
    surface = ellipsoid((0.04, 0.04, 0.04), at_rest=False)
    start = near(surface, [[1, 0, 0], [-0.5, 0.866, 0], [-0.5, -0.866, 0]])
    nodes = contour_nodes(surface, start)
    here = surface.points[start[0]]
    above = surface.points[nodes[0], 2] > here[2] + 1e-4
    barrier = np.zeros(nodes.shape)
    barrier[0, above] = 2.0
    barrier[0, 0] = 1.0  # where the contact is, it is not comfortable either
    force = barrier_force(surface.points, nodes, barrier)
    assert force[0, 2] < 0.0
    index = ForceField(ForceFieldParameters(**PURE, k_b=0.5), 3)
    proposed = index.propose(surface, start, Moves(nodes, barrier, force))
    assert surface.points[proposed[0], 2] < here[2]
    np.testing.assert_array_equal(proposed[1:], start[1:])
    unmoved = ForceField(ForceFieldParameters(**PURE, k_b=0.0), 3)
    assert unmoved.propose(surface, start, Moves(nodes, barrier, force)) is None


def test_force_along_the_normal_moves_nothing():
    surface = ellipsoid((0.04, 0.04, 0.04), at_rest=False)
    start = near(surface, [[1, 0, 0], [-0.5, 0.866, 0], [-0.5, -0.866, 0]])
    nodes = contour_nodes(surface, start)
    barrier = np.zeros(nodes.shape)
    barrier[:, 0] = 1.0
    index = ForceField(ForceFieldParameters(**PURE), 3)
    assert index.propose(surface, start, Moves(nodes, barrier, 5.0 * surface.normals[start])) is None
    aside = np.tile([0.0, 0.0, 0.1], (3, 1))
    assert (
        index.propose(surface, start, Moves(nodes, barrier, 5.0 * surface.normals[start] + aside)) is not None
    )


def test_registered_with_its_parameters_and_refuses_one_finger():
    assert INDICES["force_field"].parameters is ForceFieldParameters
    with pytest.raises(ConfigurationError, match="at least 2 fingers"):
        make_index("force_field", ForceFieldParameters(), 1)


def test_mean_radius_is_taken_from_the_centroid():
    centroid = np.array([0.1, -0.2, 0.3])
    assert mean_radius(centroid + star([0, 90, 200], radius=0.03), centroid) == pytest.approx(0.03)
