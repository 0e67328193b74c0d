import numpy as np
import pytest

from graspbench.errors import ImageError, StationError
from graspbench.perception.silhouette import Silhouette
from graspbench.reconstruction import VisualHull
from tests.oracles.scenes import scene

PIXEL_M = 0.45 / 290.0


@pytest.mark.parametrize("name", ["sphere", "egg", "bottle", "mushroom", "angle"])
def test_hull_holds_the_object(name):
    shapes = scene(name)
    points = np.vstack((shapes.mesh.vertices, shapes.mesh.sample(2000, seed=1)))
    # A pixel counts by its centre; the filter takes some more off sharp corners.
    assert VisualHull(shapes.silhouettes, smoothing_px=0.0).signed_distance(points).max() < 0.75 * PIXEL_M
    assert VisualHull(shapes.silhouettes).signed_distance(points).max() < PIXEL_M


def test_more_views_never_enlarge_the_hull():
    silhouettes = scene("mushroom").silhouettes
    points = np.random.default_rng(0).uniform([-0.06, -0.06, 0], [0.06, 0.06, 0.1], (3000, 3))
    before = VisualHull(silhouettes[:1]).signed_distance(points)
    for count in range(2, len(silhouettes) + 1):
        now = VisualHull(silhouettes[:count]).signed_distance(points)
        assert np.all(now >= before)
        before = now


def test_sign_agrees_with_looking_up_pixels():
    shapes = scene("angle")
    points = np.random.default_rng(1).uniform([-0.03, -0.03, 0.001], [0.12, 0.12, 0.04], (20000, 3))
    inside = np.ones(len(points), dtype=bool)
    for silhouette in shapes.silhouettes:
        uv = np.floor(silhouette.camera.project(points)).astype(int)
        inside &= silhouette.mask[uv[:, 1], uv[:, 0]]
    hull = VisualHull(shapes.silhouettes, smoothing_px=0.0)
    clear = np.abs(hull.signed_distance(points)) > 0.75 * PIXEL_M
    assert inside[clear].any()
    np.testing.assert_array_equal(hull.contains(points)[clear], inside[clear])


def test_distance_to_a_balls_hull_is_the_distance_to_its_tangent_cones():
    shapes = scene("sphere")
    rays = np.random.default_rng(2).normal(size=(500, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    points = shapes.centre + rays * 0.055
    hull = VisualHull(shapes.silhouettes, ground=False)
    expected = np.full(len(points), -np.inf)
    for silhouette in shapes.silhouettes:
        eye = silhouette.camera.position
        axis = (shapes.centre - eye) / np.linalg.norm(shapes.centre - eye)
        opening = np.arcsin(0.04 / np.linalg.norm(shapes.centre - eye))
        to_point = points - eye
        length = np.linalg.norm(to_point, axis=1)
        off_axis = np.arccos(np.clip(to_point @ axis / length, -1, 1))
        expected = np.maximum(expected, length * np.sin(off_axis - opening))
    np.testing.assert_allclose(hull.signed_distance(points), expected, atol=0.5 * PIXEL_M, rtol=0.05)


def test_coverage_places_the_border_within_a_fraction_of_a_pixel():
    shapes = scene("sphere")
    fine = scene("sphere", magnification=8)
    with_coverage = tuple(
        Silhouette(s.station, s.mask, s.box, s.centroid, s.camera, (0, 240, 0, 320), _binned(f.mask))
        for s, f in zip(shapes.silhouettes, fine.silhouettes, strict=True)
    )
    border = _on_cone(shapes)
    plain = np.abs(VisualHull(shapes.silhouettes[1:2]).signed_distance(border))
    sharp = np.abs(VisualHull(with_coverage[1:2]).signed_distance(border))
    assert sharp.mean() < 0.05 * PIXEL_M
    assert sharp.mean() < 0.5 * plain.mean()


def _binned(mask):
    return mask.reshape(240, 8, 320, 8).mean(axis=(1, 3)).astype(np.float32)


def _on_cone(shapes):
    """Return points where one camera's lines of sight touch the ball."""
    eye = shapes.silhouettes[1].camera.position
    axis = shapes.centre - eye
    distance = np.linalg.norm(axis)
    axis /= distance
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    angles = np.linspace(0, 2 * np.pi, 400)
    around = np.outer(np.cos(angles), side) + np.outer(np.sin(angles), np.cross(axis, side))
    tangent = 0.04 / distance
    return shapes.centre + 0.04 * (np.sqrt(1 - tangent**2) * around - tangent * axis)


def test_ground_cuts_the_hull():
    silhouettes = scene("sphere").silhouettes
    below = np.array([[0.0, 0.0, -0.002]])
    assert VisualHull(silhouettes).signed_distance(below)[0] == pytest.approx(0.002)
    assert VisualHull(silhouettes, ground=False).contains(below)[0]


def test_points_behind_a_camera_are_outside():
    silhouettes = scene("sphere").silhouettes
    camera = silhouettes[0].camera
    behind = camera.position - 0.1 * camera.rotation_camera_to_world[:, 2]
    assert not VisualHull(silhouettes[:1]).contains(behind[None])[0]


def test_gradient_leads_out_of_the_hull():
    shapes = scene("egg")
    hull = VisualHull(shapes.silhouettes)
    points = shapes.mesh.vertices * 1.05 + [0, 0, 0.001]
    out = hull.gradient(points)
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 1.0)
    gained = hull.signed_distance(points + 1e-4 * out) - hull.signed_distance(points)
    assert np.median(gained) == pytest.approx(1e-4, rel=0.1)


def test_no_silhouette_and_an_empty_one_are_errors():
    with pytest.raises(StationError, match="no silhouette"):
        VisualHull(())
    s = scene("sphere").silhouettes[0]
    empty = Silhouette("top", s.mask & False, s.box, s.centroid, s.camera, s.window, s.coverage * 0)
    with pytest.raises(ImageError, match="top"):
        VisualHull((empty,))
