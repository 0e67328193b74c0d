"""The exhaustive optimum against plain loops that share no code with it."""

import itertools

import numpy as np
import pytest

from graspbench.planning.mirtich_canny_bounds import cosine_range
from graspbench.planning.mirtich_canny_optimum import largest_outer_triangle
from tests.planning.shapes import ellipsoid, radial


def angle_deg(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def scores_by_definition(points, normals):
    """CEI, EEGI and the outer triangle, from the definitions in space."""
    plane = np.cross(points[1] - points[0], points[2] - points[0])
    if np.linalg.norm(plane) < 1e-12:
        return 90.0, 120.0, 0.0
    plane /= np.linalg.norm(plane)
    cei = np.mean([abs(angle_deg(n, plane) - 90.0) for n in normals])
    flat = normals - np.outer(normals @ plane, plane)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    eegi = np.mean([abs(angle_deg(flat[i], flat[(i + 1) % 3]) - 120.0) for i in range(3)])
    # The three lines bound a triangle that the normals point out of when they span the plane positively.
    turns = [np.cross(flat[i], flat[(i + 1) % 3]) @ plane for i in range(3)]
    if not (min(turns) > 1e-9 or max(turns) < -1e-9):
        return cei, eegi, 0.0
    corners = []
    for i in range(3):
        j = (i + 1) % 3
        system = np.array([flat[i], flat[j], plane])
        corners.append(np.linalg.solve(system, [flat[i] @ points[i], flat[j] @ points[j], plane @ points[0]]))
    area = 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    return cei, eegi, area


def waved(d):
    return 0.04 * (1 + 0.15 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 0])


@pytest.fixture(scope="module")
def small():
    """A small surface, and the scores of all its triples."""
    surface = radial(waved, meridians=7, parallels=4)
    triples = list(itertools.combinations(range(len(surface.points)), 3))
    scores = [scores_by_definition(surface.points[list(t)], surface.normals[list(t)]) for t in triples]
    return surface, triples, np.array(scores)


@pytest.mark.parametrize("thresholds", [(15.0, 10.0), (8.0, 8.0), (25.0, 4.0)])
def test_equals_the_best_of_all_triples(small, thresholds):
    surface, triples, scores = small
    within = (scores[:, 0] <= thresholds[0]) & (scores[:, 1] <= thresholds[1])
    best = int(np.argmax(np.where(within, scores[:, 2], 0.0)))
    assert within[best]
    found = largest_outer_triangle(surface, *thresholds)
    assert found.area_m2 == pytest.approx(scores[best, 2], rel=1e-12)
    # Mirror images tie.
    same = triples.index(tuple(sorted(found.vertices.tolist())))
    assert scores[same, 2] == pytest.approx(scores[best, 2], rel=1e-12)
    assert within[same]
    assert found.triples == len(triples)
    assert 0 < found.measured < found.triples


def test_says_when_no_triple_is_within_the_thresholds():
    found = largest_outer_triangle(ellipsoid((0.03, 0.04, 0.05), meridians=6, parallels=4), 1e-6, 1e-6)
    assert found.area_m2 == 0.0
    assert found.vertices.shape == (0,)


def test_circle_of_a_sphere():
    """On a sphere the largest outer triangle of 120 degrees has three times the square root of three r^2."""
    found = largest_outer_triangle(ellipsoid((0.05, 0.05, 0.05), meridians=12, parallels=11), 0.01, 0.01)
    assert found.area_m2 == pytest.approx(3 * np.sqrt(3) * 0.05**2, rel=1e-9)


@pytest.mark.parametrize("phi_cei_deg", [2.0, 15.0, 29.0, 40.0])
@pytest.mark.parametrize("phi_eegi_deg", [1.0, 10.0, 60.0])
def test_no_pair_of_a_grasp_within_the_thresholds_is_left_out(phi_cei_deg, phi_eegi_deg):
    """The pairs' range holds at the extremes of what the thresholds admit."""
    low, high = cosine_range(phi_cei_deg, phi_eegi_deg)
    rng = np.random.default_rng(1)
    shares = np.append(rng.uniform(0.0, 1.0, 2000), [0.0, 1.0, 0.5])
    total = np.radians(min(3 * phi_cei_deg, 90.0))
    signs = rng.choice([-1.0, 1.0], (2, len(shares)))
    a, b = signs[0] * shares * total, signs[1] * (1 - shares) * total
    for turn in (-1.0, 0.0, 1.0):
        phi = np.radians(120.0 + turn * min(1.5 * phi_eegi_deg, 60.0))
        cosines = np.sin(a) * np.sin(b) + np.cos(a) * np.cos(b) * np.cos(phi)
        assert low <= cosines.min()
        assert cosines.max() <= high
