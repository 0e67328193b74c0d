import numpy as np
import pytest

from graspbench.geometry.intersections import self_intersections
from graspbench.geometry.star_surface import cube_sphere
from tests.oracles.triangles import crossing_triangles


@pytest.mark.parametrize("seed", range(4))
def test_soups_agree_with_exact_arithmetic(seed):
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-1.0, 1.0, (40, 1, 3))
    vertices = (centres + 0.35 * rng.normal(size=(40, 3, 3))).reshape(-1, 3)
    faces = np.arange(120).reshape(-1, 3)
    expected = crossing_triangles(vertices, faces)
    assert 5 < len(expected) < 40
    assert set(np.flatnonzero(self_intersections(vertices, faces)).tolist()) == expected


def test_a_folded_surface_agrees_with_exact_arithmetic():
    points, faces = cube_sphere(3)
    points = points.copy()
    points[points[:, 0] > 0.5, 0] -= 2.2  # one side pushed through the opposite one: edges meet edges
    expected = crossing_triangles(points, faces)
    assert expected
    assert set(np.flatnonzero(self_intersections(points, faces)).tolist()) == expected


@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1, 50), (1e-3, 1e-3, 2e-3)])
def test_a_sound_surface_has_none(stretch):
    points, faces = cube_sphere(6)
    assert not self_intersections(points * stretch, faces).any()


def test_one_huge_triangle_among_many_small_ones_stays_cheap():
    points, faces = cube_sphere(12)
    vertices = np.concatenate([points, [[-50.0, -50.0, 0.03], [50.0, -50.0, 0.03], [0.0, 90.0, 0.03]]])
    hit = self_intersections(vertices, np.concatenate([faces, [[len(points) + k for k in range(3)]]]))
    assert hit[-1]
    assert 20 < hit.sum() < 200
