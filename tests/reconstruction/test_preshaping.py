from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.errors import ReconstructionError, StationError
from graspbench.reconstruction import SurfaceParameters, preshape
from graspbench.reconstruction.ellipsoid import moment_ellipsoid, wrap
from graspbench.reconstruction.preshaping import half_spaces, polyhedron_vertices
from tests.oracles.scenes import moved, scaled, scene

AIRBORNE = SurfaceParameters(ground=False)


def test_half_spaces_hold_the_object_and_touch_their_camera():
    shapes = scene("bottle")
    normals, offsets = half_spaces(shapes.silhouettes, ground=True)
    assert normals.shape == (4 * 13 + 1, 3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    # A pixel counts by its centre, so the object may stick out of its box by half a pixel.
    assert (normals @ shapes.mesh.vertices.T - offsets[:, None]).max() < 0.5 * 0.5 / 290
    for k, silhouette in enumerate(shapes.silhouettes):
        eye = silhouette.camera.position
        np.testing.assert_allclose(normals[4 * k : 4 * k + 4] @ eye, offsets[4 * k : 4 * k + 4])


def test_vertices_are_all_basic_feasible_solutions():
    shapes = scene("egg", outer=4, inner=0)
    normals, offsets = half_spaces(shapes.silhouettes, ground=True)
    expected = []
    for triple in combinations(range(len(normals)), 3):
        basis = normals[list(triple)]
        if abs(np.linalg.det(basis)) > 1e-9:
            x = np.linalg.solve(basis, offsets[list(triple)])
            if np.all(normals @ x <= offsets + 1e-9):
                expected.append(x)
    vertices = polyhedron_vertices(shapes.silhouettes, shapes.centre, ground=True)
    gaps = np.linalg.norm(np.array(expected)[:, None] - vertices[None], axis=2)
    assert gaps.min(axis=1).max() < 1e-7
    assert gaps.min(axis=0).max() < 1e-7
    between = np.linalg.norm(vertices[:, None] - vertices[None], axis=2) + np.eye(len(vertices))
    assert between.min() > 1e-9


def test_ellipsoid_has_the_moments_of_the_points():
    semi_axes = np.array([3.0, 2.0, 1.0])
    turn = Rotation.from_euler("xyz", [0.3, -0.8, 1.1]).as_matrix()
    directions = Rotation.random(4000, rng=np.random.default_rng(3)).apply([1.0, 0.0, 0.0])
    points = [1.0, 2.0, 3.0] + (directions * semi_axes) @ turn.T
    ellipsoid = moment_ellipsoid(points)
    np.testing.assert_allclose(ellipsoid.semi_axes, semi_axes / np.sqrt(3), rtol=0.03)
    np.testing.assert_allclose(np.abs(ellipsoid.axes.T @ turn), np.eye(3), atol=0.05)
    assert np.linalg.det(ellipsoid.axes) == pytest.approx(1.0)
    assert wrap(ellipsoid, points, 1.05).level(points).max() == pytest.approx(1 / 1.05)


@pytest.mark.parametrize("choice", ["polyhedron", "hull"])
@pytest.mark.parametrize("name", ["sphere", "bottle", "angle"])
def test_ellipsoid_wraps_the_object(name, choice):
    shapes = scene(name)
    ellipsoid = preshape(shapes.silhouettes, shapes.centre, SurfaceParameters(wrap=choice))
    assert ellipsoid.level(shapes.mesh.vertices).max() < 1.0
    assert np.all(np.diff(ellipsoid.semi_axes) <= 0)


def test_wrapping_the_hull_is_tight():
    shapes = scene("bottle")
    loose = preshape(shapes.silhouettes, shapes.centre, SurfaceParameters())
    tight = preshape(shapes.silhouettes, shapes.centre, SurfaceParameters(wrap="hull"))
    assert tight.volume_m3 < 0.8 * loose.volume_m3
    assert tight.level(shapes.mesh.vertices).max() > 0.9


@pytest.mark.parametrize("choice", ["polyhedron", "hull"])
def test_moving_the_scene_moves_the_ellipsoid(choice):
    shapes = scene("angle")
    parameters = SurfaceParameters(ground=False, wrap=choice)
    here = preshape(shapes.silhouettes, shapes.centre, parameters)
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_euler("xyz", [0.4, 1.0, -2.0]).as_matrix()
    transform[:3, 3] = [0.3, -0.2, 0.5]
    centre = transform[:3, :3] @ shapes.centre + transform[:3, 3]
    there = preshape(moved(shapes.silhouettes, transform), centre, parameters)
    # Cells at the edge of the coarse look at the hull fall in or out by rounding.
    np.testing.assert_allclose(there.centre, transform[:3, :3] @ here.centre + transform[:3, 3], atol=1e-4)
    np.testing.assert_allclose(there.axes, transform[:3, :3] @ here.axes, atol=5e-3)
    np.testing.assert_allclose(there.semi_axes, here.semi_axes, rtol=5e-3)


def test_scaling_the_scene_scales_the_ellipsoid():
    shapes = scene("angle")
    here = preshape(shapes.silhouettes, shapes.centre, SurfaceParameters())
    there = preshape(scaled(shapes.silhouettes, 3.0), 3.0 * shapes.centre, SurfaceParameters())
    np.testing.assert_allclose(there.semi_axes, 3.0 * here.semi_axes, rtol=1e-6)
    np.testing.assert_allclose(there.centre, 3.0 * here.centre, atol=1e-8)


def test_stations_that_leave_the_object_open_are_named():
    shapes = scene("sphere")
    for silhouettes, parameters in (
        (shapes.silhouettes[:1], AIRBORNE),
        (shapes.silhouettes[:1], SurfaceParameters()),
        ((shapes.silhouettes[0],) * 3, SurfaceParameters()),
    ):
        with pytest.raises(StationError, match=r"top.*do not enclose"):
            preshape(silhouettes, shapes.centre, parameters)
    with pytest.raises(StationError, match="no silhouette"):
        preshape((), shapes.centre, AIRBORNE)


def test_boxes_that_exclude_each_other_are_an_error():
    shapes = scene("sphere")
    away = np.eye(4)
    away[:3, 3] = [0.5, 0.0, 0.0]
    strangers = shapes.silhouettes[:8] + moved(shapes.silhouettes[8:], away)
    with pytest.raises(ReconstructionError, match="no point in common") as caught:
        preshape(strangers, shapes.centre, SurfaceParameters())
    assert caught.value.data["stations"]
