import numpy as np
import pytest

from graspbench.errors import ImageError, StationError
from graspbench.perception import Camera, SilhouetteParameters, Station, StationParameters, View
from graspbench.perception.detection import detect_object
from graspbench.perception.distortion import pixel_centres
from tests.perception.drawing import INTRINSICS, paint

CENTRES = pixel_centres(640, 480)


def photographer(balls, stations):
    def take(station):
        stations.append(station)
        camera = Camera(INTRINSICS, station.transform_camera_to_world)
        rays = camera.rays(CENTRES)
        inside = np.zeros(len(CENTRES), bool)
        for centre, radius in balls:
            inside |= np.linalg.norm(np.cross(centre - camera.position, rays), axis=1) < radius
        return View(station.name, paint(inside.reshape(480, 640) * 1.0), camera)

    return take


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.03), (0.12, -0.08, 0.05), (-0.2, 0.1, 0.1)])
def test_the_axes_end_on_the_object(centre):
    stations = []
    found, radius_m = detect_object(
        photographer([(np.array(centre), 0.04)], stations), StationParameters(), SilhouetteParameters()
    )
    assert radius_m == pytest.approx(0.04, abs=1.5e-3)
    np.testing.assert_allclose(found, centre, atol=1e-3)
    last = Camera(INTRINSICS, stations[-1].transform_camera_to_world)
    np.testing.assert_allclose(last.project(np.array([centre]))[0], (320, 240), atol=2.0)


@pytest.mark.parametrize(
    ("balls", "message"),
    [
        ([((0.8, 0.0, 0.04), 0.04)], "detection pass fails: no object"),
        ([((0.1, 0.0, 0.04), 0.04), ((-0.1, 0.0, 0.04), 0.04)], "two blobs"),
    ],
)
def test_no_or_several_objects_are_refused(balls, message):
    balls = [(np.array(centre), radius) for centre, radius in balls]
    with pytest.raises(ImageError, match=message):
        detect_object(photographer(balls, []), StationParameters(), SilhouetteParameters())


def test_an_object_that_sticks_out_of_the_first_slanted_views_is_found_from_farther_off():
    stations = []
    column = [(np.array([0.0, 0.0, height]), 0.07) for height in np.arange(0.07, 0.2, 0.03)]
    found, radius_m = detect_object(
        photographer(column, stations), StationParameters(), SilhouetteParameters()
    )
    assert 0.08 < found[2] < 0.2
    assert 0.1 < radius_m < 0.2
    heights = [station.transform_camera_to_world[2, 3] for station in stations]
    assert max(heights) > 1.1  # it stepped back


def test_uncertain_poses_still_lead_near_the_object():
    exact = photographer([(np.array([0.05, 0.0, 0.04]), 0.04)], [])
    generator = np.random.default_rng(0)

    def take(station):
        pose = station.transform_camera_to_world.copy()
        pose[:3, 3] += generator.normal(0.0, 0.002, 3)
        seen = exact(Station(station.name, pose))
        return View(station.name, seen.image, Camera(INTRINSICS, station.transform_camera_to_world))

    found, _ = detect_object(take, StationParameters(), SilhouetteParameters())
    np.testing.assert_allclose(found, (0.05, 0.0, 0.04), atol=8e-3)


def test_an_object_that_runs_away_is_an_error():
    position = np.array([0.0, 0.0, 0.04])

    def take(station):
        position[0] += 0.02
        return photographer([(position, 0.04)], [])(station)

    with pytest.raises(StationError, match="still moves"):
        detect_object(take, StationParameters(), SilhouetteParameters())
