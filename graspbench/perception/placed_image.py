"""An image file and the camera that took it, as any camera file says it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ImageError, StationError
from graspbench.perception.camera import Intrinsics

_RIGIDITY_TOLERANCE = 1e-4
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")
MASK_ENDING = "_mask"


@dataclass(frozen=True, eq=False)
class PlacedImage:
    """An image that has not been read yet.

    Attributes:
        station: What the view is called.
        path: The image file.
        intrinsics: Pinhole parameters in continuous image coordinates.
        transform_camera_to_world: Shape (4, 4).
    """

    station: str
    path: Path
    intrinsics: Intrinsics
    transform_camera_to_world: FloatArray


def camera_to_world(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Invert the world-to-camera motion that OpenCV and COLMAP write; shapes (3, 3) and (3,) to (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3] = rotation.T
    pose[:3, 3] = -rotation.T @ translation
    return pose


def check_rigid(pose: FloatArray, station: str, source: Path) -> None:
    """Raise a StationError where a pose is no rotation and translation."""
    rotation = pose[:3, :3]
    rigid = (
        bool(np.isfinite(pose).all())
        and np.allclose(rotation @ rotation.T, np.eye(3), atol=_RIGIDITY_TOLERANCE)
        and np.linalg.det(rotation) > 0.0
        and np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0))
    )
    if not rigid:
        raise StationError(
            f"the pose of view '{station}' in {source} is not a rotation and a translation",
            remedy="give transform_camera_to_world as a homogeneous matrix, row by row",
            station=station,
        )


def image_files(folder: Path) -> list[Path]:
    """Return the image files of a folder in alphabetical order, masks left out."""
    return sorted(
        path
        for path in folder.iterdir()
        if path.suffix.lower() in IMAGE_SUFFIXES and not path.stem.endswith(MASK_ENDING)
    )


def unreadable(path: Path, why: str) -> ImageError:
    """Return the error for a camera file that cannot be used."""
    return ImageError(f"{path} cannot be read: {why}", path=str(path))
