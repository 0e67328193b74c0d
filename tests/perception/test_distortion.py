from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspbench.errors import ConfigurationError
from graspbench.perception import Camera, CameraParameters, View
from graspbench.perception.distortion import distort, ideal_view, pixel_centres, undistort

LENS = CameraParameters(distortion=(-0.2, 0.06, 0.001, -0.0008, 0.004), cx=311.0, cy=250.0).intrinsics


def test_distortion_is_that_of_opencv():
    pixels = pixel_centres(640, 480)[::997]
    matrix = np.array([[LENS.fx, 0, LENS.cx], [0, LENS.fy, LENS.cy], [0, 0, 1]])
    rays = np.column_stack(((pixels - (LENS.cx, LENS.cy)) / (LENS.fx, LENS.fy), np.ones(len(pixels))))
    expected, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), matrix, np.array(LENS.distortion))
    np.testing.assert_allclose(distort(pixels, LENS), expected[:, 0], atol=1e-9)


@given(u=st.floats(0, 640), v=st.floats(0, 480), k1=st.floats(-0.2, 0.3), p1=st.floats(-0.002, 0.002))
def test_undistortion_inverts_distortion(u, v, k1, p1):
    lens = replace(LENS, distortion=(k1, 0.02, p1, -p1, 0.0))
    ideal = undistort(np.array([[u, v]]), lens)
    np.testing.assert_allclose(distort(ideal, lens)[0], (u, v), atol=1e-6)


def test_a_lens_that_folds_the_image_is_refused():
    with pytest.raises(ConfigurationError, match="folds"):
        undistort(pixel_centres(640, 480)[::1001], replace(LENS, distortion=(-3.0, 0, 0, 0, 0)))


def test_the_ideal_view_shows_what_a_pinhole_sees():
    def pattern(pixels):
        return 128.0 + 60.0 * np.sin(pixels[:, 0] / 17.0) + 50.0 * np.cos(pixels[:, 1] / 23.0)

    centres = pixel_centres(640, 480)
    seen = np.round(pattern(undistort(centres, LENS))).reshape(480, 640, 1)
    view = View("top", np.repeat(seen, 3, axis=2).astype(np.uint8), Camera(LENS, np.eye(4)))
    ideal = ideal_view(view)
    assert not any(ideal.camera.intrinsics.distortion)
    error = ideal.image[..., 0].reshape(-1) - pattern(centres)
    inner = np.all((distort(centres, LENS) > 1) & (distort(centres, LENS) < (639, 479)), axis=1)
    assert np.abs(error[inner]).max() < 2.0
    assert abs(error[inner].mean()) < 0.1


def test_a_view_without_distortion_is_left_alone():
    view = View("top", np.zeros((480, 640, 3), np.uint8), Camera(CameraParameters().intrinsics, np.eye(4)))
    assert ideal_view(view) is view
