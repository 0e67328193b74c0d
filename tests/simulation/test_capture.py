from dataclasses import replace

import numpy as np
import pytest
import trimesh

from graspbench.errors import ImageError, SimulationError
from graspbench.perception import (
    CameraParameters,
    SilhouetteParameters,
    StationParameters,
    place_stations,
    silhouettes,
    triangulate_centre,
)
from graspbench.simulation import EyeInHand, SceneParameters, World
from graspbench.simulation.capture import capture
from tests.oracles.exact_silhouette import exact_mask, iou
from tests.simulation.bodies import box, capsule

CAMERA, STATIONS, DEFAULT = CameraParameters(), StationParameters(), SilhouetteParameters()
CENTRE = np.array([0.0, 0.0, 0.06])
SOME = place_stations(CENTRE, STATIONS)[::4]


def take(model, scene, camera=CAMERA, seed=0):
    """Return views from some stations and the exact coverage of what they show."""
    with World(model, scene, seed) as world, EyeInHand(world, camera, seed) as eye:
        views = [eye.take(station) for station in SOME]
        vertices = trimesh.transform_points(model.mesh.vertices, world.transform_object_to_world)
        ideal = [
            replace(true, intrinsics=replace(true.intrinsics, distortion=(0.0,) * 5))
            for _, true in eye.true_cameras
        ]
    return views, [exact_mask(vertices, model.mesh.faces, camera, 5) for camera in ideal]


# The centroids' rays lead above the centre, the more so the nearer the cameras are that look down.
@pytest.mark.parametrize(("fit", "atol"), [(False, 4e-3), (True, 6e-3)])
def test_the_thirteen_views_lead_to_the_objects_centre(fit, atol):
    model = capsule()
    with World(model, SceneParameters(x_m=0.08, y_m=-0.05)) as world:
        views = capture(world, CAMERA, replace(STATIONS, fit=fit))
        centre = world.transform_object_to_world[:3, 3]
    assert [v.station for v in views] == [s.name for s in place_stations(CENTRE, STATIONS)]
    assert all(v.image.shape == (480, 640, 3) for v in views)
    np.testing.assert_allclose(triangulate_centre(silhouettes(views, DEFAULT)), centre, atol=atol)


@pytest.mark.parametrize(
    ("scene", "least"),
    [
        ({}, 0.99),
        ({"supersampling": 1}, 0.995),
        ({"renderer": "egl"}, 0.99),
        ({"full_rendering": True}, 0.99),
        ({"noise_std": 12.0, "salt_pepper": 0.01, "blur_px": 0.6}, 0.98),
        ({"table": "checker", "table_second_rgb": (0.5, 0.5, 0.5), "wall_rgb": (0.5, 0.5, 0.5)}, 0.985),
        ({"shadow": 0.9, "light_elevation_deg": 30.0, "light_gradient": 0.5}, 0.985),
    ],
)
def test_silhouettes_are_those_of_the_object(scene, least):
    try:
        views, exact = take(capsule(), SceneParameters(**scene))
    except SimulationError:
        pytest.skip("EGL does not load here")
    for silhouette, coverage in zip(silhouettes(views, DEFAULT), exact, strict=True):
        assert iou(silhouette.mask, coverage > 0.5) > least
        top, bottom, left, right = silhouette.window
        assert coverage[top:bottom, left:right].sum() == pytest.approx(coverage.sum())
        if not {"noise_std", "supersampling", "full_rendering"} & set(scene):
            assert silhouette.coverage.sum() == pytest.approx(coverage.sum(), rel=6e-3)


def test_distortion_is_put_on_and_taken_off():
    lens = replace(CAMERA, distortion=(-0.18, 0.06, 0.0005, -0.0003, 0.0))
    board = SceneParameters(table="checker", table_second_rgb=(0.6, 0.6, 0.6))
    straight, exact = take(capsule(), board)
    bent, _ = take(capsule(), board, lens)
    assert bent[0].camera.intrinsics.distortion == lens.distortion
    assert np.mean(bent[0].image != straight[0].image) > 0.05
    for silhouette, coverage in zip(silhouettes(bent, DEFAULT), exact, strict=True):
        assert iou(silhouette.mask, coverage > 0.5) > 0.985


def test_pose_noise_parts_belief_from_truth_and_nothing_else():
    small = replace(CAMERA, width=64, height=48)
    noisy = replace(small, position_noise_m=0.002, orientation_noise_deg=0.3)
    with World(capsule(), SceneParameters()) as world, EyeInHand(world, noisy, 5) as eye:
        views = [eye.take(station) for station in place_stations(CENTRE, STATIONS) * 4]
        truth = [camera.transform_camera_to_world for _, camera in eye.true_cameras]
    for station, view in zip(place_stations(CENTRE, STATIONS) * 4, views, strict=True):
        np.testing.assert_array_equal(
            view.camera.transform_camera_to_world, station.transform_camera_to_world
        )
    relative = [
        np.linalg.inv(view.camera.transform_camera_to_world) @ true
        for view, true in zip(views, truth, strict=True)
    ]
    shifts = np.array([r[:3, 3] for r in relative])
    turns = np.degrees([np.arccos(np.clip((np.trace(r[:3, :3]) - 1) / 2, -1, 1)) for r in relative])
    assert shifts.std() == pytest.approx(0.002, rel=0.2)
    assert np.sqrt(np.mean(turns**2) / 3) == pytest.approx(0.3, rel=0.2)


def test_the_flange_carries_the_camera():
    hand_eye = replace(CAMERA, hand_eye_position_m=(0.02, -0.01, 0.08), hand_eye_rpy_deg=(0.0, 10.0, 90.0))
    with World(box(), SceneParameters()) as world, EyeInHand(world, hand_eye) as eye:
        view = eye.take(SOME[0])
        camera = eye.transform_flange_to_world @ eye.transform_camera_to_flange
    np.testing.assert_allclose(camera, view.camera.transform_camera_to_world, atol=1e-12)
    np.testing.assert_allclose(eye.transform_camera_to_flange[:3, 3], (0.02, -0.01, 0.08))
    assert not np.allclose(eye.transform_flange_to_world, view.camera.transform_camera_to_world)


def test_the_seed_decides_every_pixel():
    scene = SceneParameters(noise_std=4.0, salt_pepper=0.01, table="speckle", yaw_deg=None)
    first, again, other = (take(box(), scene, seed=s)[0] for s in (7, 7, 8))
    for a, b, c in zip(first, again, other, strict=True):
        np.testing.assert_array_equal(a.image, b.image)
        assert np.any(a.image != c.image)


def test_an_object_out_of_view_is_one_clear_sentence():
    with (
        World(box(), SceneParameters(x_m=0.8)) as world,
        pytest.raises(ImageError, match="detection pass fails: no object") as raised,
    ):
        capture(world, CAMERA, STATIONS)
    assert "\n" not in str(raised.value)


def test_an_object_too_large_for_the_view_is_refused():
    model = box()
    model.mesh.apply_scale(6.0)
    large = replace(model, collision_parts=(model.mesh.convex_hull,), mass_kg=5.0)
    with World(large, SceneParameters()) as world, pytest.raises(ImageError, match=r"border|fills|no object"):
        capture(world, CAMERA, STATIONS)
