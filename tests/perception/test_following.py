"""A moving ball followed by the camera, and its motion from centroids, against what it truly did."""

import numpy as np
import pytest

from graspbench.errors import ImageError, StationError
from graspbench.geometry.planar_motion import PlanarMotion
from graspbench.perception import Camera, SilhouetteParameters, StationParameters, View, look_at
from graspbench.perception.centroid_motion import fit_centroids
from graspbench.perception.following import CentreFollower
from graspbench.perception.silhouette import silhouette_of_mask
from graspbench.perception.tracking import WIDE_SLANTS_DEG, track_object
from tests.perception.drawing import INTRINSICS, disc_coverage, paint

RADIUS_M = 0.035
PERIOD_S = 0.4


def seen_ball(centre, camera):
    """Return a ball's coverage of the image; about its middle, so that its outline is a circle."""
    u, v = camera.project(centre[None])[0]
    distance = np.linalg.norm(centre - camera.position)
    return disc_coverage(u, v, INTRINSICS.fx * RADIUS_M / np.sqrt(distance**2 - RADIUS_M**2), 1)


def look(centre, direction, distance_m=0.6):
    place = centre + distance_m * direction / np.linalg.norm(direction)
    return Camera(INTRINSICS, look_at(place, np.add(centre, [0.01, -0.02, 0.0])))


DIRECTIONS = np.array([(0, 0, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1), (0, -1, 1), (1, 1, 1), (-1, 1, 2)])


def silhouettes_of(motion, count=7):
    times = PERIOD_S * np.arange(count)
    found = []
    for k, centre in enumerate(motion.places(times)):
        camera = look(centre, DIRECTIONS[k % len(DIRECTIONS)])
        found.append(silhouette_of_mask(str(k), seen_ball(centre, camera) > 0.5, camera))
    return found, times


@pytest.mark.parametrize(
    "motion",
    [
        PlanarMotion(np.array([0.1, 0.2, 0.035]), 1.2, (0.1, -0.02)),
        PlanarMotion(np.array([0.0, 0.05, 0.035]), 1.2, (-0.03, 0.0), 0.5),
        PlanarMotion(np.array([0.0, 0.05, 0.035]), 1.2),
    ],
)
def test_centroids_tell_the_velocity_when_the_yaw_rate_is_known(motion):
    found, times = silhouettes_of(motion)
    fit = fit_centroids(found, times, 1.2, motion.yaw_rate_rad_s)
    np.testing.assert_allclose(fit.motion.velocity_m_s, motion.velocity_m_s, atol=1.5e-3)
    np.testing.assert_allclose(fit.motion.pivot, motion.pivot, atol=1e-3)
    assert fit.rms_m < 1e-3


def test_images_at_one_time_or_too_few_of_them_tell_no_motion():
    found, times = silhouettes_of(PlanarMotion(np.array([0.0, 0.0, 0.035]), 0.0))
    with pytest.raises(StationError, match="3 time-stamped views"):
        fit_centroids(found[:3], times[:3], 0.0, 0.0)
    with pytest.raises(StationError, match="time-stamped views"):
        fit_centroids(found, np.zeros(len(found)), 0.0, 0.0)


def test_images_along_one_direction_tell_no_motion():
    motion, times = PlanarMotion(np.array([0.0, 0.0, 0.035]), 0.0, (0.05, 0.0)), PERIOD_S * np.arange(6)
    camera = Camera(INTRINSICS, look_at(np.array([0.0, 0.0, 0.6]), np.zeros(3)))
    found = []
    for k, centre in enumerate(motion.places(times)):
        at = Camera(INTRINSICS, camera.transform_camera_to_world.copy())
        at.transform_camera_to_world[:3, 3] += centre - motion.pivot
        found.append(silhouette_of_mask(str(k), seen_ball(centre, at) > 0.5, at))
    with pytest.raises(StationError, match="along one direction"):
        fit_centroids(found, times, 0.0, 0.0)


def test_the_filter_predicts_where_a_straight_motion_leads():
    motion = PlanarMotion(np.array([-0.4, 0.0, 0.035]), 0.0, (0.1, 0.03))
    found, times = silhouettes_of(motion, 9)
    follower = CentreFollower(np.array([-0.38, 0.02, 0.03]), 0.0)
    for silhouette, time_s in zip(found, times, strict=True):
        follower.see(silhouette, float(time_s))
    np.testing.assert_allclose(follower.velocity_m_s[:2], motion.velocity_m_s, atol=5e-3)
    np.testing.assert_allclose(follower.predicted(3.6), motion.places([3.6])[0], atol=4e-3)


def photographer(motion, stations):
    def take(station):
        stations.append(station)
        time_s = PERIOD_S * len(stations)
        camera = Camera(INTRINSICS, station.transform_camera_to_world)
        coverage = seen_ball(motion.places([time_s])[0], camera)
        return View(station.name, paint(coverage), camera, time_s=time_s)

    return take


@pytest.mark.parametrize(
    "motion",
    [
        PlanarMotion(np.array([-0.3, 0.05, 0.035]), 0.0, (0.1, 0.0)),
        PlanarMotion(np.array([0.05, 0.0, 0.035]), 0.0, (0.0, 0.026), 0.52),
    ],
)
def test_every_station_has_the_moving_object_near_its_middle(motion):
    stations = []
    entry = motion.places([0.0])[0] * [1.0, 1.0, 0.0] + [0.05, -0.03, 0.0]
    seen = track_object(
        photographer(motion, stations), entry, StationParameters(), INTRINSICS, SilhouetteParameters()
    )
    assert [view.station for view in seen.views][:3] == ["top", "outer-0", "outer-1"]
    assert len(seen.views) == 13
    assert len(seen.wide) == len(WIDE_SLANTS_DEG)
    times = [view.time_s for view in seen.views]
    assert times == sorted(times)
    for view, centre in zip(seen.views, motion.places(np.array(times)), strict=True):
        np.testing.assert_allclose(view.camera.project(centre[None])[0], (320, 240), atol=30.0)


def test_an_empty_belt_is_said_to_be_empty():
    motion = PlanarMotion(np.array([2.0, 0.0, 0.035]), 0.0)
    with pytest.raises(ImageError, match="loses the moving object: no object"):
        track_object(
            photographer(motion, []), np.zeros(3), StationParameters(), INTRINSICS, SilhouetteParameters()
        )
