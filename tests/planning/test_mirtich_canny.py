import itertools

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.planning.index import Moves, free_moves, make_index
from graspbench.planning.indices.mirtich_canny import (
    MirtichCanny,
    MirtichCannyParameters,
    mirtich_canny_scores,
    score_contacts,
)
from tests.planning.shapes import ellipsoid, radial


def antipodal_scores(points, normals):
    scores = np.empty(3)
    score_contacts(np.ascontiguousarray(points), np.ascontiguousarray(normals), scores)
    return scores[0], scores[2]


def star(angles_deg, radius=0.04):
    angles = np.deg2rad(angles_deg)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(len(angles))])


def test_ideal_grasp_of_a_circle():
    points = star([0, 120, 240])
    cei, eegi, area = mirtich_canny_scores(points, points / 0.04)
    assert cei == pytest.approx(0.0, abs=1e-9)
    assert eegi == pytest.approx(0.0, abs=1e-9)
    assert area == pytest.approx(3 * np.sqrt(3) * 0.04**2)


def test_errors_are_mean_angles():
    points = star([0, 120, 240])
    tilted = points / 0.04
    tilted[0] = [np.cos(np.deg2rad(30)), 0.0, np.sin(np.deg2rad(30))]
    tilted[1, 2] = -np.tan(np.deg2rad(12))
    tilted[1] /= np.linalg.norm(tilted[1])
    cei, eegi, _ = mirtich_canny_scores(points, tilted)
    assert cei == pytest.approx((30 + 12) / 3)
    assert eegi == pytest.approx(0.0, abs=1e-9)
    # Pairs 100, 130 and 130 degrees apart.
    turned = star([0, 130, 230], radius=1.0)
    cei, eegi, _ = mirtich_canny_scores(points, turned)
    assert cei == pytest.approx(0.0, abs=1e-9)
    assert eegi == pytest.approx((10 + 10 + 20) / 3)


def test_inward_and_outward_normals_score_the_same():
    rng = np.random.default_rng(3)
    points, normals = rng.normal(size=(20, 3, 3)), rng.normal(size=(20, 3, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    for one, two in zip(
        mirtich_canny_scores(points, normals), mirtich_canny_scores(points, -normals), strict=True
    ):
        np.testing.assert_allclose(one, two, atol=1e-9)


def triangle_by_intersection(points, normals):
    """Outer triangle from the corners where its lines meet, in coordinates of the plane."""
    x = points[1] - points[0]
    x /= np.linalg.norm(x)
    z = np.cross(x, points[2] - points[0])
    z /= np.linalg.norm(z)
    frame = np.array([x, np.cross(z, x)])
    p, n = points @ frame.T, normals @ frame.T
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    corners = [np.linalg.solve(n[[i, j]], [n[i] @ p[i], n[j] @ p[j]]) for i, j in ((0, 1), (1, 2), (2, 0))]
    (ax, ay), (bx, by) = corners[1] - corners[0], corners[2] - corners[0]
    return abs(ax * by - ay * bx) / 2


def test_outer_triangle_equals_the_one_through_its_corners():
    rng = np.random.default_rng(4)
    for _ in range(50):
        points = star(np.array([0, 120, 240]) + rng.uniform(-20, 20, 3)) + 0.002 * rng.normal(size=(3, 3))
        normals = star(np.array([0, 120, 240]) + rng.uniform(-20, 20, 3), radius=1.0)
        normals += 0.1 * rng.normal(size=(3, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        _, _, area = mirtich_canny_scores(points, normals)
        assert area == pytest.approx(triangle_by_intersection(points, normals), rel=1e-9)


def test_normals_on_one_side_have_no_outer_triangle():
    points = star([0, 120, 240])
    _, _, area = mirtich_canny_scores(points, star([0, 40, 80], radius=1.0))
    assert area == 0.0


def reference_merit(points, normals, parameters):
    cei, eegi, area = (float(value) for value in mirtich_canny_scores(points, normals))
    if cei > parameters.phi_cei_deg or eegi > parameters.phi_eegi_deg or area <= 0:
        return -cei / parameters.phi_cei_deg - eegi / parameters.phi_eegi_deg
    errors = cei / parameters.phi_cei_deg + eegi / parameters.phi_eegi_deg
    return area * (1 - parameters.error_weight * errors / 2)


def near(surface, directions):
    arms = surface.points - surface.centroid
    arms = arms / np.linalg.norm(arms, axis=1, keepdims=True)
    return np.argmax(arms @ np.asarray(directions, dtype=float).T, axis=0)


def waved(d):
    return 0.04 * (1 + 0.1 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 0])


@pytest.mark.parametrize("phi_cei_deg", [15.0, 2.0])
def test_proposes_the_best_of_all_combinations_of_the_contours(phi_cei_deg):
    parameters = MirtichCannyParameters(phi_cei_deg=phi_cei_deg)
    surface = radial(waved, meridians=24, parallels=17)
    start = near(surface, [[1, 0.2, 0.3], [-0.5, 0.9, 0.2], [-0.4, -0.866, -0.1]])
    moves = free_moves(surface, start)
    values = {
        combination: reference_merit(
            surface.points[list(combination)], surface.normals[list(combination)], parameters
        )
        for combination in itertools.product(*moves.nodes.tolist())
        if len(set(combination)) == 3
    }
    proposed = MirtichCanny(parameters, 3).propose(surface, start, moves)
    assert values[tuple(proposed.tolist())] == pytest.approx(max(values.values()), rel=1e-12)


def test_climbs_into_the_feasible_region_and_to_rest():
    surface = radial(waved)
    parameters = MirtichCannyParameters()
    index = MirtichCanny(parameters, 3)
    vertices = near(surface, [[1, 0.5, 0.5], [-0.3, 0.9, 0.0], [-0.7, -0.5, -0.3]])
    assert index.score(surface, vertices) < 0.0
    scores = [index.score(surface, vertices)]
    while (proposed := index.propose(surface, vertices, free_moves(surface, vertices))) is not None:
        vertices = proposed
        scores.append(index.score(surface, vertices))
        assert len(scores) < 100
    assert np.all(np.diff(scores) > 0.0)
    cei, eegi, area = mirtich_canny_scores(surface.points[vertices], surface.normals[vertices])
    assert cei <= parameters.phi_cei_deg
    assert eegi <= parameters.phi_eegi_deg
    assert area > 0


def test_unreachable_nodes_are_never_chosen():
    surface = radial(waved)
    start = near(surface, [[1, 0.5, 0.5], [-0.3, 0.9, 0.0], [-0.7, -0.5, -0.3]])
    moves = free_moves(surface, start)
    nodes = moves.nodes.copy()
    nodes[0, 1:] = -1
    proposed = MirtichCanny(MirtichCannyParameters(), 3).propose(
        surface, start, Moves(nodes, moves.barrier, moves.barrier_force)
    )
    assert proposed is not None
    assert proposed[0] == start[0]


def test_two_fingers_end_on_the_longest_antipodal_line():
    surface = ellipsoid((0.03, 0.045, 0.08))
    index = MirtichCanny(MirtichCannyParameters(), 2)
    vertices = near(surface, [[0.3, 0.2, 1], [-0.2, 0.1, -1]])
    while (proposed := index.propose(surface, vertices, free_moves(surface, vertices))) is not None:
        vertices = proposed
    error, distance = antipodal_scores(surface.points[vertices], surface.normals[vertices])
    assert error < 5.0
    assert distance == pytest.approx(0.16, rel=0.02)


def test_antipodal_error_is_the_mean_angle_to_the_line():
    points = np.array([[0.03, 0.0, 0.0], [-0.03, 0.0, 0.0]])
    normals = np.array([[np.cos(0.2), np.sin(0.2), 0.0], [-1.0, 0.0, 0.0]])
    error, distance = antipodal_scores(points, normals)
    assert error == pytest.approx(np.rad2deg(0.1))
    assert distance == pytest.approx(0.06)
    # Pressed from inside, the contacts face the wrong way.
    assert antipodal_scores(points, -normals)[0] == pytest.approx(180 - np.rad2deg(0.1))


@pytest.mark.parametrize("n_f", [1, 4, 5])
def test_says_for_how_many_fingers_it_is_defined(n_f):
    with pytest.raises(ConfigurationError, match=f"not for {n_f}: set hand.fingers to 3"):
        make_index("mirtich_canny", MirtichCannyParameters(), n_f)
