"""Image files and the masks beside them."""

import io
from pathlib import Path
from typing import Literal, TypeAlias

import cv2
import numpy as np
from PIL import Image, UnidentifiedImageError

from graspbench.arrays import BoolArray, ImageArray
from graspbench.errors import ImageError
from graspbench.perception.placed_image import MASK_ENDING

ExifOrientation: TypeAlias = Literal["refuse", "honour", "ignore"]

_ORIENTATION_TAG = 0x0112
_UPRIGHT = 1


def read_image(path: Path, exif: ExifOrientation) -> ImageArray:
    """Return an image's colours, RGB, shape (h, w, 3).

    Args:
        path: Any format that OpenCV reads.
        exif: Whether a photograph that its EXIF data call turned is turned, left as stored, or refused.

    Raises:
        ImageError: The file is missing or unreadable, or turned and to be refused.
    """
    return np.ascontiguousarray(_decode(path, exif)[..., ::-1])


def read_mask(image: Path, shape: tuple[int, ...], exif: ExifOrientation) -> BoolArray | None:
    """Return the mask beside an image: True where it is brighter than half; None if there is none.

    Args:
        image: The image ``NAME.suffix``; its mask is ``NAME_mask.png``.
        shape: Rows and columns that it must have.
        exif: As for `read_image`.

    Raises:
        ImageError: The mask is unreadable, or not of the image's size.
    """
    path = image.with_name(f"{image.stem}{MASK_ENDING}.png")
    if not path.is_file():
        return None
    mask: BoolArray = _decode(path, exif).max(axis=2) >= 128
    if mask.shape != shape:
        raise ImageError(
            f"mask {path} has {mask.shape[1]} x {mask.shape[0]} pixels, its image {shape[1]} x {shape[0]}",
            remedy="give a mask of the image's size",
            path=str(path),
        )
    return mask


def _decode(path: Path, exif: ExifOrientation) -> ImageArray:
    data = path.read_bytes() if path.is_file() else b""
    orientation = _orientation(data)
    if orientation != _UPRIGHT and exif == "refuse":
        raise ImageError(
            f"{path} is turned by its EXIF data (orientation {orientation})",
            remedy="set scene.exif_orientation to honour if the camera is that of the turned picture, to "
            "ignore if it is that of the pixels as stored",
            path=str(path),
        )
    flags = cv2.IMREAD_COLOR if exif == "honour" else cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags) if data else None
    if pixels is None:
        raise ImageError(f"image {path} is missing or unreadable", path=str(path))
    return np.asarray(pixels, dtype=np.uint8)


def _orientation(data: bytes) -> int:
    """Return the EXIF orientation of an image file, 1 for upright or where there is none."""
    try:
        with Image.open(io.BytesIO(data)) as image:
            return int(image.getexif().get(_ORIENTATION_TAG, _UPRIGHT))
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, TypeError):
        return _UPRIGHT
