from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.errors import ImageError
from graspbench.perception import Camera, SilhouetteParameters, View, silhouettes
from graspbench.perception.distortion import pixel_centres, undistort
from graspbench.perception.silhouette import silhouette_of_mask, without_holes
from tests.oracles.exact_silhouette import iou
from tests.perception.drawing import INTRINSICS, TABLE, disc_coverage, paint, view_of

DEFAULT = SilhouetteParameters()


def find(image, parameters=DEFAULT):
    return silhouettes([view_of(image)], parameters)[0]


@settings(max_examples=12, deadline=None)
@given(u=st.floats(150, 450), v=st.floats(150, 330), radius=st.floats(12, 110))
def test_a_disc_is_found_to_a_fraction_of_a_pixel(u, v, radius):
    coverage = disc_coverage(u, v, radius)
    found = find(paint(coverage))
    assert iou(found.mask, coverage > 0.5) > 1.0 - 0.5 / radius
    np.testing.assert_allclose(found.centroid, (u, v), atol=0.15)
    np.testing.assert_allclose(found.box, (u - radius, v - radius, u + radius, v + radius), atol=1.0)
    top, bottom, left, right = found.window
    error = found.coverage - coverage[top:bottom, left:right]
    assert np.abs(error).max() < 0.1
    assert found.coverage.sum() == pytest.approx(np.pi * radius**2, rel=0.01)


def test_box_and_centroid_of_a_mask_in_continuous_coordinates():
    mask = np.zeros((480, 640), bool)
    mask[100:140, 200:210] = True
    found = silhouette_of_mask("top", mask, view_of(paint(mask * 1.0)).camera)
    assert found.box == (200.0, 100.0, 210.0, 140.0)
    np.testing.assert_allclose(found.centroid, (205.0, 120.0))


def test_shadow_and_gradient_are_background():
    coverage = disc_coverage(320, 240, 60)
    image = paint(coverage).astype(float)
    shadow = disc_coverage(360, 265, 60) * (coverage == 0)
    image *= 1.0 - 0.55 * shadow[..., None]
    image *= np.linspace(0.8, 1.2, 640)[None, :, None]
    found = find(np.clip(image, 0, 255).astype(np.uint8))
    assert iou(found.mask, coverage > 0.5) > 0.99


def test_noise_and_stuck_pixels_are_withstood():
    coverage = disc_coverage(320, 240, 60)
    image = paint(coverage, noise=14.0)
    stuck = np.random.default_rng(1).random(coverage.shape)
    image[stuck < 0.01], image[stuck > 0.99] = 0, 255
    assert iou(find(image).mask, coverage > 0.5) > 0.98


def test_a_background_of_several_colours_is_learned():
    coverage = disc_coverage(320, 240, 60)
    cells = (np.arange(640) // 40 + np.arange(480)[:, None] // 40) % 2
    board = np.where(cells[..., None] == 0, [150.0, 150.0, 155.0], [35.0, 55.0, 95.0])
    assert iou(find(paint(coverage, background=board)).mask, coverage > 0.5) > 0.99


@pytest.mark.parametrize("level", [0.0, 255.0])
def test_black_and_white_objects_differ_from_a_lit_table(level):
    coverage = disc_coverage(320, 240, 60)
    assert iou(find(paint(coverage, colour=np.full(3, level))).mask, coverage > 0.5) > 0.99


def test_holes_that_show_the_background_stay_unless_told_otherwise():
    ring = disc_coverage(320, 240, 60) - disc_coverage(320, 240, 25)
    silhouette = find(paint(ring))
    assert silhouette.holes == 1
    assert not silhouette.mask[240, 320]
    assert iou(silhouette.mask, ring > 0.5) > 0.99
    assert find(paint(ring), replace(DEFAULT, fill_holes=True)).mask[240, 320]


def test_small_holes_are_filled():
    ring = disc_coverage(320, 240, 60) - disc_coverage(320, 240, 4)
    assert find(paint(ring)).holes == 0
    assert find(paint(ring), replace(DEFAULT, hole_fraction=0.002)).holes == 1


def test_a_spot_that_only_resembles_the_background_is_no_hole():
    disc = disc_coverage(320, 240, 60)
    image = paint(disc)
    background = image[5, 5].astype(float)
    spot = disc_coverage(320, 240, 25)[..., None]
    image = np.clip((1 - spot) * image + spot * (background + np.array([0, 0, 9])), 0, 255).astype(np.uint8)
    assert find(image).holes == 0


def test_filled_holes_leave_a_solid_silhouette_and_the_outline_as_it_is():
    ring = disc_coverage(320, 240, 60) - disc_coverage(320, 240, 25)
    solid, holed = find(paint(disc_coverage(320, 240, 60))), find(paint(ring))
    (filled,) = without_holes([holed])
    np.testing.assert_array_equal(filled.mask, solid.mask)
    np.testing.assert_allclose(filled.coverage, solid.coverage, atol=0.02)
    assert without_holes([solid])[0] is solid


def test_specks_are_dropped():
    coverage = disc_coverage(320, 240, 60) + disc_coverage(60, 60, 3)
    assert not find(paint(coverage)).mask[:100, :100].any()


def test_a_distorted_view_gives_the_silhouette_of_the_ideal_camera():
    lens = replace(INTRINSICS, distortion=(-0.15, 0.05, 0.001, 0.0, 0.0))
    ideal = undistort(pixel_centres(640, 480), lens)
    inside = (np.hypot(ideal[:, 0] - 250, ideal[:, 1] - 330) < 70).reshape(480, 640)
    pose = view_of(np.zeros((480, 640, 3), np.uint8)).camera.transform_camera_to_world
    found = silhouettes([View("top", paint(inside * 1.0), Camera(lens, pose))], DEFAULT)[0]
    assert not any(found.camera.intrinsics.distortion)
    assert iou(found.mask, disc_coverage(250, 330, 70) > 0.5) > 0.98
    np.testing.assert_allclose(found.centroid, (250, 330), atol=0.2)


def test_an_object_that_hides_the_border_of_one_view_is_noticed_by_the_others():
    usual = [view_of(paint(disc_coverage(320, 240, 60)), f"outer-{i}") for i in range(5)]
    close = view_of(paint(np.ones((480, 640))), "top")
    with pytest.raises(ImageError, match="fills the image at station top"):
        silhouettes([*usual, close], DEFAULT)


@pytest.mark.parametrize(
    ("coverage", "message"),
    [
        (np.zeros((480, 640)), "no object stands out from the background at station outer-3"),
        (disc_coverage(320, 240, 2), "no object stands out"),
        (disc_coverage(20, 240, 60), "touches the image border at station outer-3"),
        (disc_coverage(200, 240, 50) + disc_coverage(450, 240, 48), "could be the object at station outer-3"),
    ],
)
def test_unusable_images_are_one_clear_sentence(coverage, message):
    with pytest.raises(ImageError, match=message) as raised:
        find(paint(coverage, noise=2.0))
    assert raised.value.data["station"] == "outer-3"
    assert "\n" not in str(raised.value)


def test_unusable_masks_are_refused():
    camera = view_of(np.zeros((480, 640, 3), np.uint8)).camera
    with pytest.raises(ImageError, match="no object"):
        silhouette_of_mask("top", np.zeros((480, 640), bool), camera)
    with pytest.raises(ImageError, match="fills"):
        silhouette_of_mask("top", np.ones((480, 640), bool), camera)


def test_an_object_of_the_tables_own_colour_is_not_invented():
    with pytest.raises(ImageError, match="no object"):
        find(paint(disc_coverage(320, 240, 60), colour=TABLE * 0.97, noise=2.0))
