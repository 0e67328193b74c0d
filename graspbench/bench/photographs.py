"""Images of an object on the table, and the truth about them."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.bench.timing import best_time
from graspbench.config.trial_config import TrialConfig
from graspbench.geometry import load_object
from graspbench.perception import Silhouette, silhouettes
from graspbench.perception.camera import Camera
from graspbench.perception.detection import detect_object
from graspbench.perception.stations import fit_stations, place_stations
from graspbench.simulation import World
from graspbench.simulation.capture import EyeInHand


@dataclass(frozen=True, eq=False)
class Photographs:
    """One object seen from all stations.

    Attributes:
        silhouettes: What was found in the images.
        centre: What the detection pass found, shape (3,).
        vertices: The object's vertices in the world, shape (n, 3).
        faces: Its triangles, shape (m, 3).
        true_cameras: The cameras as they really were, without distortion, one a silhouette.
        images_s: Shortest time to take all images.
        silhouettes_s: Shortest time to find all silhouettes.
    """

    silhouettes: tuple[Silhouette, ...]
    centre: FloatArray
    vertices: FloatArray
    faces: IntArray
    true_cameras: tuple[Camera, ...]
    images_s: float
    silhouettes_s: float


def photograph(config: TrialConfig, *, repeats: int) -> Photographs:
    """Put an object on the table, find it and take its images.

    Args:
        config: Object, scene, camera, stations and silhouettes are read.
        repeats: How often images are taken and silhouettes found, to time both.

    Raises:
        InputError: The object cannot be used, or cannot be seen.
        SimulationError: It does not come to rest.
    """
    model = load_object(config.object)
    with World(model, config.scene, config.seed) as world:
        pose = world.object_pose()
        with EyeInHand(world, config.camera, config.seed) as camera:
            centre, radius_m = detect_object(camera.take, config.stations, config.silhouette)
            fitted = fit_stations(config.stations, config.camera.intrinsics, radius_m)
            stations = place_stations(centre, fitted)
            images_s, views = best_time(lambda: [camera.take(station) for station in stations], repeats)
            true_cameras = tuple(true for _, true in camera.true_cameras[-len(stations) :])
    silhouettes_s, found = best_time(lambda: silhouettes(views, config.silhouette), repeats + 2)
    vertices = np.asarray(model.mesh.vertices) @ pose[:3, :3].T + pose[:3, 3]
    return Photographs(
        found, centre, vertices, np.asarray(model.mesh.faces), true_cameras, images_s, silhouettes_s
    )
