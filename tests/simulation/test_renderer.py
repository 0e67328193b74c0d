from dataclasses import replace

import numpy as np
import pytest

from graspbench.errors import SimulationError
from graspbench.perception import Camera, CameraParameters, look_at
from graspbench.simulation.renderer import Renderer, projection_matrix
from graspbench.simulation.scene import SceneParameters
from tests.oracles.exact_silhouette import exact_mask, iou
from tests.simulation.bodies import box, capsule

POSE = np.eye(4)
POSE[:3, 3] = (0.01, -0.02, 0.06)


@pytest.fixture(scope="module", params=["tiny", "egl"])
def renderer(request):
    try:
        drawn = Renderer(capsule(), POSE, SceneParameters(renderer=request.param))
    except SimulationError:
        pytest.skip("EGL does not load here")
    with drawn:
        yield drawn


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.31, -0.43), (-25.25, 18.5)])
@pytest.mark.parametrize("position", [(0.4, 0.1, 0.3), (-0.02, 0.05, 0.5), (-0.3, -0.4, 0.05)])
def test_images_are_those_of_an_exact_pinhole(renderer, offset, position):
    parameters = CameraParameters(
        width=320, height=240, fx=420.0, fy=400.0, cx=160 + offset[0], cy=120 + offset[1]
    )
    camera = Camera(parameters.intrinsics, look_at(np.array(position), np.array([0.0, 0.0, 0.06])))
    _, bodies = renderer.render(camera.intrinsics, camera.transform_camera_to_world)
    seen = bodies == renderer.object_body
    mesh = capsule().mesh
    exact = exact_mask(mesh.vertices + POSE[:3, 3], mesh.faces, camera) > 0.5
    assert iou(seen, exact) > 0.995
    rows, columns = np.nonzero(seen)
    exact_rows, exact_columns = np.nonzero(exact)
    # Half a pixel's shift would show here.
    assert abs(rows.mean() - exact_rows.mean()) < 0.05
    assert abs(columns.mean() - exact_columns.mean()) < 0.05


def test_a_window_of_the_image_is_the_same_image(renderer):
    k = CameraParameters().intrinsics
    pose = look_at(np.array([0.4, 0.1, 0.3]), np.array([0.02, 0.03, 0.06]))
    whole, bodies = renderer.render(k, pose)
    top, bottom, left, right = renderer.window(k, pose, 3)
    part = replace(k, width=right - left, height=bottom - top, cx=k.cx - left, cy=k.cy - top)
    image, inside = renderer.render(part, pose)
    expected = bodies[top:bottom, left:right]
    assert (bodies >= 0).sum() == (expected >= 0).sum(), "the window holds the whole object"
    assert np.mean(inside != expected) < 2e-4
    both = (inside >= 0) & (expected >= 0)
    difference = image[both].astype(int) - whole[top:bottom, left:right][both]
    assert np.abs(difference).mean() < 0.5


def test_the_window_ends_at_the_image_and_is_none_out_of_view(renderer):
    k = CameraParameters().intrinsics
    beside = look_at(np.array([0.4, 0.0, 0.3]), np.array([0.0, 0.19, 0.06]))
    top, bottom, left, right = renderer.window(k, beside, 3)
    assert 0 <= top < bottom <= k.height
    assert left == 0 or right == k.width
    away = look_at(np.array([0.4, 0.0, 0.3]), np.array([0.9, 0.0, 0.3]))
    assert renderer.window(k, away, 3) is None


def test_the_projection_puts_points_where_the_pinhole_does():
    k = CameraParameters(cx=300.0, cy=260.0, fx=700.0).intrinsics
    matrix = np.reshape(projection_matrix(k, "egl"), (4, 4)).T
    x, y, z = 0.1, -0.05, 0.8
    clip = matrix @ (x, -y, -z, 1.0)
    u, v = (clip[0] / clip[3] + 1) / 2 * k.width, (1 - clip[1] / clip[3]) / 2 * k.height
    np.testing.assert_allclose((u, v), (k.fx * x / z + k.cx, k.fy * y / z + k.cy))


def test_the_light_comes_from_where_the_scene_says():
    k, pose = CameraParameters().intrinsics, look_at(np.array([0.0, -0.5, 0.06]), np.array([0.01, 0, 0.06]))
    brightness = {}
    for azimuth in (0.0, 180.0):
        scene = SceneParameters(light_azimuth_deg=azimuth, light_elevation_deg=20.0)
        with Renderer(capsule(), POSE, scene) as drawn:
            image, bodies = drawn.render(k, pose)
        column = np.nonzero(bodies >= 0)[1].mean()
        right = bodies >= 0
        right[:, : int(column)] = False
        brightness[azimuth] = image[right].mean()
    assert brightness[0.0] > brightness[180.0] + 10.0, "the camera's right side is the world's +x"


def test_nothing_is_written_to_standard_output(capfd):
    try:
        with Renderer(box(), POSE, SceneParameters(renderer="egl")) as drawn:
            drawn.render(CameraParameters().intrinsics, look_at(np.array([0.4, 0, 0.3]), np.zeros(3)))
    except SimulationError:
        pytest.skip("EGL does not load here")
    assert capfd.readouterr().out == ""
