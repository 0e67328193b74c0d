"""The eye-in-hand camera visits its stations and takes the images."""

from dataclasses import replace
from types import TracebackType
from typing import Self

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray, ImageArray
from graspbench.perception.camera import Camera, CameraParameters, Intrinsics, View
from graspbench.perception.detection import detect_object
from graspbench.perception.distortion import pixel_centres, undistort
from graspbench.perception.segmentation import SilhouetteParameters
from graspbench.perception.stations import Station, StationParameters, fit_stations, place_stations
from graspbench.simulation.colours import scene_colours
from graspbench.simulation.renderer import Renderer
from graspbench.simulation.scene import SceneParameters
from graspbench.simulation.sensor import expose
from graspbench.simulation.table import Table, build_table
from graspbench.simulation.world import World

FloatImage = npt.NDArray[np.float32]

_WINDOW_MARGIN = 2


class EyeInHand:
    """A camera on the robot's flange, which moves freely.

    The robot moves its flange to where it believes the camera meets a station; noise of the pose is
    what it does not know. Use it as a context manager, or call `close`.

    Args:
        world: The scene, at rest.
        parameters: The camera.
        seed: Draws the noise of images and poses, and random patterns of the table.

    Attributes:
        transform_camera_to_flange: The hand-eye calibration, shape (4, 4).
        transform_flange_to_world: Where the robot believes its flange is, shape (4, 4).
        true_cameras: For each image taken: the station's name and the camera as it really was.
    """

    def __init__(self, world: World, parameters: CameraParameters, seed: int = 0) -> None:
        self._world, self._parameters, self._seed = world, parameters, seed
        self.transform_camera_to_flange = _pose_of_rpy(
            parameters.hand_eye_position_m, parameters.hand_eye_rpy_deg
        )
        self.transform_flange_to_world: FloatArray = np.eye(4)
        self.true_cameras: list[tuple[str, Camera]] = []
        self._object_to_table, scene = self._arranged()
        self._table = self._laid_table(scene)
        self._renderer = Renderer(
            world.object_model,
            self._object_to_table,
            scene,
            self._table.texture if scene.full_rendering else None,
            self._table.size_m,
        )
        self._lens = _Lens(parameters.intrinsics)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()

    def take(self, station: Station) -> View:
        """Move the flange to a station and take an image."""
        generator = np.random.default_rng((self._seed, len(self.true_cameras)))
        self._follow()
        believed = station.transform_camera_to_world
        self.transform_flange_to_world = believed @ np.linalg.inv(self.transform_camera_to_flange)
        actual = believed @ self._pose_noise(generator)
        k = self._lens.intrinsics
        self.true_cameras.append((station.name, Camera(k, actual)))
        seen_from = self._world.to_table @ actual if self._world.moves else actual
        image = self._lens.distort(self._draw(self._lens.ideal, seen_from))
        time_s = self._world.time_s if self._world.moves else None
        exposed = expose(image, self._world.scene, generator)
        return View(station.name, exposed, Camera(k, believed), time_s=time_s)

    def _arranged(self) -> tuple[FloatArray, SceneParameters]:
        """Return the object's pose on the table, and the scene with the lamp as the table sees it."""
        pose, scene = self._world.object_pose(), self._world.scene
        if not self._world.moves:
            return pose, scene
        to_table = self._world.to_table
        turned_deg = float(np.degrees(np.arctan2(to_table[1, 0], to_table[0, 0])))
        return to_table @ pose, replace(scene, light_azimuth_deg=scene.light_azimuth_deg + turned_deg)

    def _laid_table(self, scene: SceneParameters) -> Table:
        """Draw the table top with the object's shadow."""
        model, pose = self._world.object_model, self._object_to_table
        vertices = np.asarray(model.mesh.vertices) @ pose[:3, :3].T + pose[:3, 3]
        lit = replace(scene, shadow=0.0) if scene.full_rendering else scene
        return build_table(lit, scene_colours(scene, model.rgba), vertices, model.mesh.faces, self._seed)

    def _follow(self) -> None:
        """Arrange the scene as it is now, if it moves: all is drawn in the frame of the moving table."""
        if not self._world.moves:
            return
        self._object_to_table, scene = self._arranged()
        self._renderer.move(self._object_to_table, scene)
        self._table = self._laid_table(scene)

    def _pose_noise(self, generator: np.random.Generator) -> FloatArray:
        """Return the actual camera's pose in the believed camera's frame, shape (4, 4)."""
        position = generator.standard_normal(3) * self._parameters.position_noise_m
        rotation = generator.standard_normal(3) * np.radians(self._parameters.orientation_noise_deg)
        noise = np.eye(4)
        noise[:3, :3] = Rotation.from_rotvec(rotation).as_matrix()
        noise[:3, 3] = position
        return noise

    def _draw(self, k: Intrinsics, pose: FloatArray) -> ImageArray:
        """Draw the scene through an ideal lens."""
        image = self._table.image(k, pose)
        if self._world.scene.full_rendering:
            drawn, bodies = self._renderer.render(k, pose)
            return np.where(bodies[..., None] >= 0, drawn, image)
        window = self._renderer.window(k, pose, _WINDOW_MARGIN)
        if window is None:
            return image
        top, bottom, left, right = window
        part = replace(k, width=right - left, height=bottom - top, cx=k.cx - left, cy=k.cy - top)
        colour, share = self._draw_object(part, pose)
        below = image[top:bottom, left:right].astype(np.float32)
        image[top:bottom, left:right] = (colour + (1.0 - share[..., None]) * below + 0.5).astype(np.uint8)
        return image

    def _draw_object(self, k: Intrinsics, pose: FloatArray) -> tuple[FloatImage, FloatImage]:
        """Draw the object alone with soft edges.

        Returns:
            Its colour times the share of each pixel that it covers, shape (h, w, 3), and that share,
            shape (h, w).
        """
        n = self._world.scene.supersampling
        # Even n: the trapezoidal rule, samples on the pixel's border and in its centre. Odd n: the
        # midpoint rule. Both sample the centre, so no straight edge leaves a row of pixels undecided.
        shared = 1 - n % 2
        fine = Intrinsics(
            n * k.width + shared,
            n * k.height + shared,
            n * k.fx,
            n * k.fy,
            n * k.cx + 0.5 * shared,
            n * k.cy + 0.5 * shared,
        )
        drawn, bodies = self._renderer.render(fine, pose)
        mask = (bodies == self._renderer.object_body).astype(np.float32)
        colour = drawn * mask[..., None]
        return _average(colour, n, k), _average(mask, n, k)


def _average(fine: FloatImage, n: int, k: Intrinsics) -> FloatImage:
    """Average n x n subpixels to one; for even n neighbours share the subpixels on their border."""
    if n == 1:
        return fine
    if n % 2:
        mean: FloatImage = cv2.resize(fine, (k.width, k.height), interpolation=cv2.INTER_AREA)
        return mean
    weights = np.full(n + 1, 1.0 / n, dtype=np.float32)
    weights[[0, -1]] *= 0.5
    rows = sum(w * fine[i : i + n * k.height : n] for i, w in enumerate(weights))
    columns = sum(w * np.asarray(rows)[:, i : i + n * k.width : n] for i, w in enumerate(weights))
    return np.asarray(columns, dtype=np.float32)


def capture(
    world: World,
    camera_parameters: CameraParameters,
    station_parameters: StationParameters,
    seed: int = 0,
    silhouette_parameters: SilhouetteParameters | None = None,
) -> tuple[View, ...]:
    """Find the object, place the stations about it and take an image at each.

    Args:
        world: The scene, at rest.
        camera_parameters: The camera.
        station_parameters: The station set.
        seed: Draws the noise of images and poses.
        silhouette_parameters: How the detection pass tells the object from the background.

    Raises:
        ImageError: The object, or a single one, is not in view.
        StationError: The stations are degenerate or outside the workspace.
    """
    with EyeInHand(world, camera_parameters, seed) as camera:
        blobs = silhouette_parameters or SilhouetteParameters()
        found = detect_object(camera.take, station_parameters, blobs)
        fitted = fit_stations(station_parameters, camera_parameters.intrinsics, found.radius_m)
        return tuple(camera.take(station) for station in place_stations(found.centre, fitted))


class _Lens:
    """Distortion as the lens makes it: an ideal image, larger where needed, is resampled.

    Attributes:
        intrinsics: The camera's parameters.
        ideal: Parameters of the ideal image to draw.
    """

    def __init__(self, intrinsics: Intrinsics) -> None:
        k = intrinsics
        self.intrinsics, self.ideal = k, k
        if not any(k.distortion):
            return
        where = undistort(pixel_centres(k.width, k.height), k)
        left, top = np.floor(where.min(axis=0)).astype(int) - 1
        right, bottom = np.ceil(where.max(axis=0)).astype(int) + 1
        self.ideal = Intrinsics(
            int(right - left), int(bottom - top), k.fx, k.fy, k.cx - float(left), k.cy - float(top)
        )
        # cv2 puts pixel centres at whole numbers.
        lookup = (where - (left, top) - 0.5).reshape(k.height, k.width, 2).astype(np.float32)
        self._columns, self._rows = np.ascontiguousarray(lookup[..., 0]), np.ascontiguousarray(lookup[..., 1])

    def distort(self, image: ImageArray) -> ImageArray:
        """Resample an ideal image as the lens shows it."""
        if self.ideal is self.intrinsics:
            return image
        distorted: ImageArray = cv2.remap(image, self._columns, self._rows, cv2.INTER_LINEAR)
        return distorted


def _pose_of_rpy(position: tuple[float, float, float], rpy_deg: tuple[float, float, float]) -> FloatArray:
    """Return the pose, shape (4, 4), of a position and roll, pitch, yaw about fixed axes in degrees."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    pose[:3, 3] = position
    return pose
