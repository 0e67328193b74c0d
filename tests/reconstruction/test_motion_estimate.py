"""The motion of bodies from their synthetic silhouettes, against what they truly did."""

import cv2
import numpy as np
import pytest
import trimesh

from graspbench.geometry.planar_motion import PlanarMotion
from graspbench.perception import Camera, CameraParameters, look_at
from graspbench.perception.silhouette import silhouette_of_mask
from graspbench.reconstruction.motion_estimate import camera_in_object_frame, estimate_motion
from graspbench.reconstruction.silhouette_coherence import SilhouetteCoherence

INTRINSICS = CameraParameters().intrinsics
PERIOD_S = 0.4
WIDE = [(0, 0), (45, 0), (45, 90), (45, 180), (45, 270), (0, 0)]
STATIONS = [(0, 0), *((65, 45 * i) for i in range(8)), *((35, 22.5 + 90 * i) for i in range(4))]
BOX = trimesh.creation.box((0.06, 0.04, 0.1))
BALL = trimesh.creation.icosphere(3, 0.04)
PIVOT = np.array([0.02, -0.01, 0.03])


def silhouette(mesh, pose, camera, name):
    """Draw a mesh's silhouette with OpenCV: nothing of the product's renderer is in it."""
    corners = camera.project(np.asarray(mesh.vertices) @ pose[:3, :3].T + pose[:3, 3])
    mask = np.zeros((480, 640), np.uint8)
    for triangle in np.round((corners[mesh.faces] - 0.5) * 16).astype(np.int32):
        cv2.fillConvexPoly(mask, triangle, 1, shift=4)
    return silhouette_of_mask(name, mask.astype(bool), camera)


def photographed(mesh, motion):
    """Return silhouettes of a mesh standing on the table, which moves, and their times."""
    at_reference = np.eye(4)
    at_reference[:3, 3] = [*motion.pivot[:2], -mesh.bounds[0, 2]]
    found, times = [], []
    looks = [(way, 0.8) for way in WIDE] + [(way, 0.4) for way in STATIONS]
    for k, ((angle, azimuth), distance_m) in enumerate(looks):
        pose = motion.displacement(PERIOD_S * k) @ at_reference
        a, z = np.radians((angle, azimuth))
        way = np.array([np.sin(a) * np.cos(z), np.sin(a) * np.sin(z), np.cos(a)])
        camera = Camera(INTRINSICS, look_at(pose[:3, 3] + distance_m * way, pose[:3, 3]))
        found.append(silhouette(mesh, pose, camera, str(k)))
        times.append(PERIOD_S * k)
    return found, np.array(times)


def errors(mesh, motion):
    """Return how far the estimate leads the body astray, mm and deg, and the estimate."""
    found, times = photographed(mesh, motion)
    estimate = estimate_motion(found, times, motion.reference_time_s)
    truth = motion.about(estimate.motion.pivot)
    off = np.linalg.norm(estimate.motion.places(times) - truth.places(times), axis=1)
    turned = np.abs(np.degrees(estimate.motion.yaws(times) - truth.yaws(times)))
    return 1e3 * off.max(), turned.max(), estimate


@pytest.mark.parametrize(
    "motion",
    [
        PlanarMotion(PIVOT, 4.0, (0.1, 0.0)),
        PlanarMotion(PIVOT, 4.0, (0.0, 0.026), np.radians(30.0)),
        PlanarMotion(PIVOT, 4.0, (0.03, 0.01), -0.2, (0.004, -0.002), 0.02),
        PlanarMotion(PIVOT, 4.0),
    ],
    ids=["conveyor", "turntable", "drift", "still"],
)
def test_a_box_is_followed_to_half_a_millimetre_and_half_a_degree(motion):
    off_mm, turned_deg, estimate = errors(BOX, motion)
    assert off_mm < 0.5
    assert turned_deg < 0.5
    assert estimate.motion.varies == motion.varies
    assert estimate.coherence_rms_m < 0.1e-3
    # The pivot is the box's middle, wherever the motion was told of.
    assert estimate.motion.pivot[2] == pytest.approx(0.05, abs=3e-3)


def test_a_ball_that_spins_in_place_is_taken_to_stand_still():
    off_mm, _, estimate = errors(BALL, PlanarMotion(PIVOT, 4.0, (0.0, 0.0), 0.5))
    assert off_mm < 0.3
    assert abs(estimate.motion.yaw_rate_rad_s) < 0.1


def test_a_ball_that_goes_round_tells_by_its_path_that_it_turns():
    off_mm, _, estimate = errors(BALL, PlanarMotion(PIVOT, 4.0, (0.0, 0.026), 0.52))
    assert off_mm < 0.5
    assert estimate.motion.yaw_rate_rad_s == pytest.approx(0.52, abs=0.03)


def test_silhouettes_agree_in_the_true_motion_and_in_no_other():
    motion = PlanarMotion(PIVOT, 4.0, (0.1, 0.0))
    found, times = photographed(BOX, motion)
    coherence = SilhouetteCoherence(found, times, 0.07)
    least = np.sum(coherence.residuals(motion) ** 2)
    for other in (
        PlanarMotion(PIVOT, 4.0, (0.102, 0.0)),
        PlanarMotion(PIVOT, 4.0, (0.1, 0.002)),
        PlanarMotion(PIVOT, 4.0, (0.1, 0.0), 0.02),
        PlanarMotion(PIVOT, 4.0),
    ):
        assert np.sum(coherence.residuals(other) ** 2) > 10.0 * least + 1e-6


def test_a_camera_in_the_objects_frame_sees_it_where_it_was():
    motion = PlanarMotion(PIVOT, 1.0, (0.1, 0.02), 0.4, (0.01, 0.0), 0.05)
    camera = Camera(INTRINSICS, look_at(np.array([0.3, -0.2, 0.5]), np.zeros(3)))
    point = np.array([0.03, 0.01, 0.06, 1.0])
    then = motion.displacement(3.0) @ point
    still = camera_in_object_frame(camera, motion, 3.0)
    np.testing.assert_allclose(still.project(point[None, :3]), camera.project(then[None, :3]), atol=1e-9)
