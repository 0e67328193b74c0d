"""Silhouettes: where in an image the object is (thesis 3.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, ImageArray
from graspbench.errors import ImageError
from graspbench.perception.background import Background, FloatImage, learn_background
from graspbench.perception.camera import Camera, View
from graspbench.perception.distortion import ideal_view

_COARSENESS = 4
_CROP_MARGIN = 12
_FULL_FRACTION = 0.9
_NEIGHBOURHOOD = 7


@dataclass(frozen=True)
class SilhouetteParameters:
    """How the object is told from the background."""

    darkest_shadow: Annotated[
        float,
        Field(gt=0, le=1, description="Brightness left in the deepest shadow, fraction"),
    ] = 0.35
    border_fraction: Annotated[
        float,
        Field(
            gt=0,
            lt=0.4,
            description="Width of the border that is surely background, fraction of height",
        ),
    ] = 0.08
    contrast: Annotated[
        float, Field(gt=0, description="Least colour distance between object and background, grey levels")
    ] = 10.0
    erosion_px: Annotated[int, Field(ge=0, le=20, description="Erosion that removes specks, pixels")] = 1
    dilation_px: Annotated[
        int, Field(ge=0, le=20, description="Dilation that follows, and closes gaps, pixels")
    ] = 1
    fill_holes: Annotated[bool, Field(description="Whether holes in the silhouette are filled")] = True
    smallest_area_px: Annotated[
        int, Field(ge=1, description="Smallest area that counts as an object, pixels")
    ] = 64
    rival_fraction: Annotated[
        float,
        Field(gt=0, le=1, description="A second blob larger than this fraction of the first is an ambiguity"),
    ] = 0.5


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


def silhouettes(views: Sequence[View], parameters: SilhouetteParameters) -> tuple[Silhouette, ...]:
    """Find the object in each view.

    The background is learned from the borders of all images together, so an object that fills one of
    them is noticed. Each threshold is tuned on its own image.

    Args:
        views: Images of one scene; lens distortion is removed first.
        parameters: How the object is told from the background.

    Raises:
        ImageError: In some view the object is missing, fills the image, touches its border, or is not
            the only one; the error names the station.
    """
    ideal = [ideal_view(view) for view in views]
    small = [_shrink(view.image) for view in ideal]
    if not ideal:
        return ()
    background = learn_background(small, parameters.darkest_shadow, parameters.border_fraction)
    return tuple(
        _silhouette(view, coarse, background, parameters) for view, coarse in zip(ideal, small, strict=True)
    )


def silhouette_of_mask(
    station: str, mask: BoolArray, camera: Camera, coverage: FloatImage | None = None
) -> Silhouette:
    """Describe a mask as a silhouette.

    Args:
        station: Name of the station.
        mask: True where the object is, shape (height, width), one blob.
        camera: The camera, without distortion.
        coverage: Fraction of each pixel covered, shape (height, width); from the mask if None.

    Raises:
        ImageError: The mask is empty, full, or touches the border.
    """
    height, width = mask.shape
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows) == 0:
        raise _empty(station)
    top, bottom, left, right = int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
    inner = mask[top:bottom, left:right]
    if inner.sum() > _FULL_FRACTION * mask.size:
        raise _full(station)
    if top == 0 or left == 0 or bottom == height or right == width:
        raise ImageError(
            f"the object touches the image border at station {station}",
            remedy="move the stations further away, or use a wider lens (camera.fx, camera.fy)",
            station=station,
        )
    per_column, per_row = inner.sum(axis=0), inner.sum(axis=1)
    area = float(per_row.sum())
    centroid = np.array(
        (
            left + 0.5 + float(per_column @ np.arange(right - left)) / area,
            top + 0.5 + float(per_row @ np.arange(bottom - top)) / area,
        )
    )
    window = (max(top - 2, 0), min(bottom + 2, height), max(left - 2, 0), min(right + 2, width))
    cut = (slice(window[0], window[1]), slice(window[2], window[3]))
    share = mask[cut].astype(np.float32) if coverage is None else np.ascontiguousarray(coverage[cut])
    box = (float(left), float(top), float(right), float(bottom))
    return Silhouette(station, mask, box, centroid, camera, window, share)


def _silhouette(
    view: View, coarse: ImageArray, background: Background, parameters: SilhouetteParameters
) -> Silhouette:
    """Find the object in one view: roughly in a small copy, then exactly around what was found."""
    station = view.station
    height, width = view.image.shape[:2]
    top, bottom, left, right = _locate(station, coarse, background, parameters)
    rows = slice(max(top - _CROP_MARGIN, 0), min(bottom + _CROP_MARGIN, height))
    columns = slice(max(left - _CROP_MARGIN, 0), min(right + _CROP_MARGIN, width))

    crop = np.ascontiguousarray(view.image[rows, columns])
    distance = background.distance(cv2.medianBlur(crop, 3))
    threshold = _threshold(distance, background.noise, parameters)
    inside = _largest_blob(_clean((distance > threshold).astype(np.uint8), parameters))
    if inside is None:
        raise _empty(station)
    if parameters.fill_holes:
        inside = _fill_holes(inside)
    mask = np.zeros((height, width), dtype=np.bool_)
    mask[rows, columns] = inside
    coverage = np.zeros((height, width), dtype=np.float32)
    coverage[rows, columns] = _coverage(background.distance(crop), inside)
    return silhouette_of_mask(station, mask, view.camera, coverage)


def _locate(
    station: str, coarse: ImageArray, background: Background, parameters: SilhouetteParameters
) -> tuple[int, int, int, int]:
    """Return the rows and columns (first, end) of the object, found in a small copy of the image."""
    distance = background.distance(coarse)
    threshold = _threshold(distance, background.noise, parameters)
    mask = (distance > threshold).astype(np.uint8)
    if mask.mean() > _FULL_FRACTION:
        raise _full(station)
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    areas = stats[1:count, cv2.CC_STAT_AREA] * _COARSENESS**2
    if count < 2 or areas.max() < parameters.smallest_area_px:
        raise _empty(station)
    order = np.argsort(-areas, kind="stable")
    if count > 2 and areas[order[1]] > parameters.rival_fraction * areas[order[0]]:
        raise ImageError(
            f"two blobs of {areas[order[0]]} and {areas[order[1]]} pixels "
            f"could be the object at station {station}",
            remedy="leave one object in view, or even out the background",
            station=station,
        )
    left, top, width, height = (int(x) * _COARSENESS for x in stats[1 + order[0], :4])
    return top, top + height, left, left + width


def _threshold(distance: FloatImage, noise: float, parameters: SilhouetteParameters) -> float:
    """Choose the threshold on the colour distance: Otsu's, but never within the background's noise."""
    scaled = np.minimum(distance, 255.0).astype(np.uint8)
    otsu, _ = cv2.threshold(scaled, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    return max(0.5 * float(otsu), 1.2 * noise, parameters.contrast)


def _clean(mask: npt.NDArray[np.uint8], parameters: SilhouetteParameters) -> npt.NDArray[np.uint8]:
    """Erode and dilate (an opening), then dilate and erode (a closing)."""
    if parameters.erosion_px:
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, _disc(parameters.erosion_px))
    if parameters.dilation_px:
        mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _disc(parameters.dilation_px))
    return mask


def _disc(radius: int) -> npt.NDArray[np.uint8]:
    kernel: npt.NDArray[np.uint8] = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1,) * 2)
    return kernel


def _largest_blob(mask: npt.NDArray[np.uint8]) -> BoolArray | None:
    """Keep the largest connected blob."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    if count < 2:
        return None
    blob: BoolArray = labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return blob


def _fill_holes(mask: BoolArray) -> BoolArray:
    """Fill every hole that does not open to the image's border."""
    outside = np.pad(~mask, 1, constant_values=True).astype(np.uint8)
    cv2.floodFill(outside, None, (0, 0), 2, flags=4)
    filled: BoolArray = outside[1:-1, 1:-1] != 2
    return filled


def _coverage(distance: FloatImage, inside: BoolArray) -> FloatImage:
    """Estimate how much of each border pixel the object covers.

    A pixel that both share has a colour in between, and the distance to the background's brightness
    line grows linearly with the object's share; so it is divided by the object's own distance nearby.
    """
    solid = cv2.erode(inside.astype(np.uint8), _disc(1))
    kernel = (_NEIGHBOURHOOD, _NEIGHBOURHOOD)
    weight = cv2.boxFilter(solid.astype(np.float32), -1, kernel, normalize=False)
    total = cv2.boxFilter(np.where(solid > 0, distance, np.float32(0.0)), -1, kernel, normalize=False)
    share = np.clip(distance * weight / np.maximum(total, np.float32(1e-3)), 0.0, 1.0)
    near = cv2.dilate(inside.astype(np.uint8), _disc(1)).astype(np.bool_) & (weight > 0)
    estimated = np.where(near, share, inside.astype(np.float32))
    coverage: FloatImage = np.where(solid > 0, np.float32(1.0), estimated).astype(np.float32)
    return coverage


def _shrink(image: ImageArray) -> ImageArray:
    """Return a small copy, averaged so that noise and thin lines fade."""
    height, width = image.shape[:2]
    size = (max(width // _COARSENESS, 1), max(height // _COARSENESS, 1))
    small: ImageArray = cv2.resize(
        image[: size[1] * _COARSENESS, : size[0] * _COARSENESS], size, interpolation=cv2.INTER_AREA
    )
    return small


def _empty(station: str) -> ImageError:
    return ImageError(
        f"no object stands out from the background at station {station}",
        remedy="check the light and the table's colour, or lower silhouette.contrast",
        station=station,
    )


def _full(station: str) -> ImageError:
    return ImageError(
        f"the object fills the image at station {station}",
        remedy="move the stations further away",
        station=station,
    )
