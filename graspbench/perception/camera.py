"""The calibrated pinhole camera and what it delivers."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray, ImageArray


@dataclass(frozen=True)
class Intrinsics:
    """Pinhole parameters in pixels, continuous image coordinates (see `graspbench.arrays`).

    Attributes:
        width: Image columns.
        height: Image rows.
        fx: Focal length along u.
        fy: Focal length along v.
        cx: Principal point, u.
        cy: Principal point, v.
        distortion: Brown-Conrady coefficients (k1, k2, p1, p2, k3); all zero for an ideal lens.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Camera:
    """A calibrated camera at a station.

    Attributes:
        intrinsics: Its pinhole parameters.
        transform_camera_to_world: Pose of the optical frame, shape (4, 4).
    """

    intrinsics: Intrinsics
    transform_camera_to_world: FloatArray

    @property
    def position(self) -> FloatArray:
        """Optical centre in the world, shape (3,)."""
        return self.transform_camera_to_world[:3, 3]

    @property
    def rotation_camera_to_world(self) -> FloatArray:
        """Orientation of the optical frame, shape (3, 3)."""
        return self.transform_camera_to_world[:3, :3]

    def project(self, points: FloatArray) -> FloatArray:
        """Project world points without lens distortion.

        Args:
            points: World coordinates, shape (n, 3), in front of the camera.

        Returns:
            Image coordinates (u, v), shape (n, 2).
        """
        local = (points - self.position) @ self.rotation_camera_to_world
        k = self.intrinsics
        return np.column_stack(
            (
                k.fx * local[:, 0] / local[:, 2] + k.cx,
                k.fy * local[:, 1] / local[:, 2] + k.cy,
            )
        )

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Return the unit viewing directions of image points, without lens distortion.

        Args:
            pixels: Image coordinates (u, v), shape (n, 2).

        Returns:
            World directions, shape (n, 3).
        """
        k = self.intrinsics
        local = np.column_stack(
            (
                (pixels[:, 0] - k.cx) / k.fx,
                (pixels[:, 1] - k.cy) / k.fy,
                np.ones(len(pixels)),
            )
        )
        directions = local @ self.rotation_camera_to_world.T
        unit: FloatArray = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return unit


@dataclass(frozen=True)
class View:
    """One image taken at a station.

    Attributes:
        station: Name of the station, for example "top", "outer-3".
        image: RGB image, shape (height, width, 3).
        camera: The calibrated camera that took it (what the robot believes, noise included).
    """

    station: str
    image: ImageArray
    camera: Camera
