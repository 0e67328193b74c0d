import numpy as np
import pytest

from graspbench.planning.grip_plane import grip_geometry
from graspbench.planning.initial import equilateral_vertices, initial_grasps, initial_planes, principal_axes
from tests.planning.shapes import ellipsoid, surface_of


def turned(semi_axes, seed):
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    base = ellipsoid(semi_axes)
    return surface_of(base.points @ q.T + [0.1, 0.2, 0.3], 39, 39), q


@pytest.mark.parametrize("seed", range(5))
def test_axes_of_an_ellipsoid_longest_first(seed):
    surface, q = turned((0.03, 0.08, 0.05), seed)
    axes = principal_axes(surface)
    np.testing.assert_allclose(np.abs(axes.T @ q[:, [1, 2, 0]]), np.eye(3), atol=1e-6)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_first_plane_is_that_of_the_two_minor_axes():
    surface, q = turned((0.03, 0.08, 0.05), 1)
    grasps = next(initial_grasps(surface, 3, 4))
    assert abs(grasps[0].plane_normal @ q[:, 1]) == pytest.approx(1.0, abs=1e-6)
    assert {grasp.plane for grasp in grasps} == {0}


def test_next_planes_are_tilted_more_and_more():
    normals = initial_planes(np.eye(3))
    tilt = np.rad2deg(np.arccos(np.clip(normals[:, 0], -1, 1)))
    assert np.all(np.diff(tilt) > -1e-9)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert len({tuple(np.round(n, 6)) for n in normals}) == len(normals) == 11


@pytest.mark.parametrize("n_f", [2, 3, 4, 5])
def test_grasps_are_equilateral_about_the_plane_normal(n_f):
    surface = ellipsoid((0.04, 0.045, 0.09), meridians=60)
    for grasp in next(initial_grasps(surface, n_f, 5)):
        found = grip_geometry(surface.points[grasp.vertices], surface.centroid)
        assert found.equilateral_error_deg < 7.0
        if n_f > 2:
            assert found.normal @ grasp.plane_normal > 0.99
            assert found.plane_offset_m < 2e-3


def test_rotations_turn_the_grasp_evenly():
    surface = ellipsoid((0.04, 0.04, 0.08), meridians=60)
    grasps = next(initial_grasps(surface, 3, 4))
    arms = surface.points[[grasp.vertices[0] for grasp in grasps]]
    azimuth = np.unwrap(np.arctan2(arms[:, 1], arms[:, 0]))
    np.testing.assert_allclose(np.abs(np.diff(azimuth)), np.deg2rad(30), atol=np.deg2rad(6.1))


def test_nearest_nodes_of_the_rays():
    surface = ellipsoid((0.04, 0.04, 0.04), meridians=12, parallels=11)
    found = equilateral_vertices(
        surface, np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), 4, np.array([0.0, np.pi / 6])
    )
    expected = [
        [[1, 0], [0, 1], [-1, 0], [0, -1]],
        [[0.866, 0.5], [-0.5, 0.866], [-0.866, -0.5], [0.5, -0.866]],
    ]
    np.testing.assert_allclose(surface.points[found][..., :2] / 0.04, expected, atol=1e-3)
    np.testing.assert_allclose(surface.points[found][..., 2], 0.0, atol=1e-12)
