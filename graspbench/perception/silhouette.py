"""Silhouettes: where in an image the object is (thesis 3.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from graspbench.arrays import BoolArray, FloatArray
from graspbench.errors import ImageError
from graspbench.perception.background import FloatImage
from graspbench.perception.blobs import disc, fill_holes, hole_count
from graspbench.perception.camera import Camera

FULL_FRACTION = 0.9
"""An object of this share of the image fills it."""


@dataclass(frozen=True, eq=False)
class Silhouette:
    """The object's outline seen from one station, as an ideal pinhole sees it.

    Attributes:
        station: Name of the station.
        mask: True where the object is, shape (height, width).
        box: Smallest axis-aligned rectangle around it (u_min, v_min, u_max, v_max), continuous image
            coordinates.
        centroid: Mean of its pixels, continuous image coordinates, shape (2,).
        camera: The camera, without distortion.
        window: First row, end row, first column, end column of `coverage` in the image.
        coverage: Fraction of each pixel that the object covers, estimated from its colour, shape
            (end row - first row, end column - first column); 0 outside the window.
    """

    station: str
    mask: BoolArray
    box: tuple[float, float, float, float]
    centroid: FloatArray
    camera: Camera
    window: tuple[int, int, int, int]
    coverage: FloatImage
    margin_px: int = 0

    @property
    def image_mask(self) -> BoolArray:
        """The mask within the image."""
        return self.mask[
            self.margin_px : self.mask.shape[0] - self.margin_px,
            self.margin_px : self.mask.shape[1] - self.margin_px,
        ]

    @property
    def holes(self) -> int:
        """Number of holes through which the background is seen."""
        top, bottom, left, right = self.window
        return hole_count(self.mask[top:bottom, left:right])


def without_holes(silhouettes: Sequence[Silhouette]) -> tuple[Silhouette, ...]:
    """Return silhouettes with their holes filled; those without holes as they are."""
    return tuple(_filled(silhouette) if silhouette.holes else silhouette for silhouette in silhouettes)


def _filled(silhouette: Silhouette) -> Silhouette:
    top, bottom, left, right = silhouette.window
    inside = silhouette.mask[top:bottom, left:right]
    filled = fill_holes(inside)
    # The rim of a hole is covered in part, within two pixels of it.
    rim = cv2.dilate((filled & ~inside).astype(np.uint8), disc(2)).astype(np.bool_) & filled
    outer = cv2.erode(filled.astype(np.uint8), disc(1), borderValue=0).astype(np.bool_)
    coverage = np.where(rim & outer, np.float32(1.0), silhouette.coverage)
    found = describe(
        silhouette.station,
        filled,
        silhouette.window,
        coverage,
        silhouette.camera,
        fills=silhouette.margin_px > 0,
    )
    return replace(found, margin_px=silhouette.margin_px)


def silhouette_of_mask(station: str, mask: BoolArray, camera: Camera) -> Silhouette:
    """Describe a mask as a silhouette.

    Args:
        station: Name of the station.
        mask: True where the object is, shape (height, width), one blob.
        camera: The camera, without distortion.

    Raises:
        ImageError: The mask is empty, full, or touches the border.
    """
    height, width = mask.shape
    return describe(station, mask, (0, height, 0, width), mask.astype(np.float32), camera)


def describe(
    station: str,
    inside: BoolArray,
    window: tuple[int, int, int, int],
    coverage: FloatImage,
    camera: Camera,
    *,
    fills: bool = False,
) -> Silhouette:
    """Describe a mask and its coverage.

    Args:
        station: Name of the station.
        inside: True where the object is, on the window.
        window: First row, end row, first column, end column in the image.
        coverage: Fraction of each pixel that the object covers, on the window.
        camera: The camera, without distortion.
        fills: Whether the object may fill the image.

    Raises:
        ImageError: The mask is empty, full, or touches the border.
    """
    height, width = camera.intrinsics.height, camera.intrinsics.width
    per_row, per_column = inside.sum(axis=1), inside.sum(axis=0)
    rows, columns = np.flatnonzero(per_row), np.flatnonzero(per_column)
    if len(rows) == 0:
        raise no_object(station)
    area = float(per_row.sum())
    if area > FULL_FRACTION * height * width and not fills:
        raise fills_image(station)
    top, bottom = window[0] + int(rows[0]), window[0] + int(rows[-1]) + 1
    left, right = window[2] + int(columns[0]), window[2] + int(columns[-1]) + 1
    if top == 0 or left == 0 or bottom == height or right == width:
        raise ImageError(
            f"the object touches the image border at station {station}",
            remedy="move the stations further away, or use a wider lens (camera.fx, camera.fy)",
            station=station,
        )
    mask = np.zeros((height, width), dtype=np.bool_)
    mask[window[0] : window[1], window[2] : window[3]] = inside
    centroid = np.array(
        (
            window[2] + 0.5 + float(per_column @ np.arange(len(per_column))) / area,
            window[0] + 0.5 + float(per_row @ np.arange(len(per_row))) / area,
        )
    )
    box = (float(left), float(top), float(right), float(bottom))
    return Silhouette(station, mask, box, centroid, camera, window, coverage)


def no_object(station: str) -> ImageError:
    """Return the error that a station sees nothing."""
    return ImageError(
        f"no object stands out from the background at station {station}",
        remedy="check the light and the table's colour, or lower silhouette.contrast",
        station=station,
    )


def fills_image(station: str) -> ImageError:
    """Return the error that the object fills a station's image."""
    return ImageError(
        f"the object fills the image at station {station}",
        remedy="move the stations further away",
        station=station,
    )
