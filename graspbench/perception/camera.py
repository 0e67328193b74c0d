"""The calibrated pinhole camera and what it delivers."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, ImageArray
from graspbench.errors import StationError


@dataclass(frozen=True)
class CameraParameters:
    """The camera in the robot's hand, and how well the robot knows it.

    The image may be distorted and the believed poses noisy; `View.camera` is always what the robot
    believes, and carries the distortion.
    """

    width: Annotated[int, Field(ge=32, le=4096, description="Image columns")] = 640
    height: Annotated[int, Field(ge=32, le=4096, description="Image rows")] = 480
    fx: Annotated[float, Field(gt=0, le=1e5, description="Focal length along u, pixels")] = 750.0
    fy: Annotated[float, Field(gt=0, le=1e5, description="Focal length along v, pixels")] = 750.0
    cx: Annotated[
        float | None, Field(ge=-1e5, le=1e5, description="Principal point u, pixels; null = width / 2")
    ] = None
    cy: Annotated[
        float | None, Field(ge=-1e5, le=1e5, description="Principal point v, pixels; null = height / 2")
    ] = None
    distortion: Annotated[
        tuple[float, float, float, float, float],
        Field(description="Lens distortion after Brown and Conrady: k1, k2, p1, p2, k3"),
    ] = (0.0, 0.0, 0.0, 0.0, 0.0)
    hand_eye_position_m: Annotated[
        tuple[float, float, float], Field(description="Optical centre in the flange frame, m")
    ] = (0.0, 0.0, 0.06)
    hand_eye_rpy_deg: Annotated[
        tuple[float, float, float],
        Field(description="Optical frame in the flange frame: roll, pitch, yaw (fixed axes x, y, z), deg"),
    ] = (0.0, 0.0, 0.0)
    position_noise_m: Annotated[
        float, Field(ge=0, description="Standard deviation of the believed position, per axis, m")
    ] = 0.0
    orientation_noise_deg: Annotated[
        float, Field(ge=0, description="Standard deviation of the believed orientation, per axis, deg")
    ] = 0.0

    @property
    def intrinsics(self) -> "Intrinsics":
        """The pinhole parameters these settings describe."""
        return Intrinsics(
            self.width,
            self.height,
            self.fx,
            self.fy,
            self.width / 2 if self.cx is None else self.cx,
            self.height / 2 if self.cy is None else self.cy,
            self.distortion,
        )


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
        mask: Where the object is, shape (height, width), if that is known from elsewhere.
        time_s: When it was taken, if the scene moves.
    """

    station: str
    image: ImageArray
    camera: Camera
    mask: BoolArray | None = None
    time_s: float | None = None


def look_at(position: FloatArray, target: FloatArray) -> FloatArray:
    """Return the pose of a camera that looks at a point with the world's z axis upwards in the image.

    Straight down, the image's upward direction is the world's y axis.

    Args:
        position: Optical centre, shape (3,).
        target: Point the optical axis meets, shape (3,).

    Returns:
        transform_camera_to_world, shape (4, 4).

    Raises:
        StationError: Position and target coincide.
    """
    axis = np.asarray(target, dtype=np.float64) - position
    distance = float(np.linalg.norm(axis))
    if distance < 1e-9:
        raise StationError("a camera cannot look at its own optical centre", position=tuple(position))
    axis /= distance
    right = np.array([axis[1], -axis[0], 0.0])
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack((right, np.cross(axis, right), axis))
    pose[:3, 3] = position
    return pose
