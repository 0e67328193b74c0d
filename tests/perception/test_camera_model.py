import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspbench.errors import StationError
from graspbench.perception import Camera, CameraParameters, look_at

coordinate = st.floats(-1.0, 1.0)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)


@given(position=point, target=point)
def test_a_camera_looks_where_it_is_told_and_keeps_upright(position, target):
    if np.linalg.norm(target - position) < 1e-3:
        return
    camera = Camera(CameraParameters().intrinsics, look_at(position, target))
    rotation = camera.rotation_camera_to_world
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(camera.project(target[None])[0], (320.0, 240.0), atol=1e-6)
    assert rotation[2, 0] == pytest.approx(0.0, abs=1e-9), "the image's rows stay level"
    assert rotation[2, 1] <= 1e-9, "the image's upper half looks higher"


@given(u=st.floats(0.0, 640.0), v=st.floats(0.0, 480.0), depth=st.floats(0.1, 3.0))
def test_rays_invert_projection(u, v, depth):
    camera = Camera(
        CameraParameters(cx=300.0, cy=260.0, fy=700.0).intrinsics,
        look_at(np.array([0.3, -0.2, 0.5]), np.array([0.0, 0.05, 0.1])),
    )
    ray = camera.rays(np.array([[u, v]]))[0]
    np.testing.assert_allclose(np.linalg.norm(ray), 1.0)
    seen = camera.project((camera.position + depth * ray)[None])[0]
    np.testing.assert_allclose(seen, (u, v), atol=1e-8)


def test_straight_down_the_image_shows_y_upwards():
    camera = Camera(CameraParameters().intrinsics, look_at(np.array([0.0, 0.0, 0.5]), np.zeros(3)))
    u, v = camera.project(np.array([[0.01, 0.02, 0.0]]))[0]
    assert u > 320.0
    assert v < 240.0


def test_a_camera_cannot_look_at_itself():
    with pytest.raises(StationError, match="optical centre"):
        look_at(np.ones(3), np.ones(3))


def test_the_principal_point_is_the_middle_unless_given():
    assert CameraParameters(width=200, height=100).intrinsics.cx == 100.0
    assert CameraParameters(cx=3.0, cy=4.0).intrinsics.cy == 4.0
