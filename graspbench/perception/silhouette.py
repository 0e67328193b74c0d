"""Silhouettes: where in an image the object is (thesis 3.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, ImageArray
from graspbench.errors import ImageError
from graspbench.perception.background import Background, FloatImage, learn_background
from graspbench.perception.blobs import (
    ByteMask,
    clean,
    close,
    disc,
    fill_holes,
    fill_holes_but,
    holes,
    largest_blob,
)
from graspbench.perception.camera import Camera, View
from graspbench.perception.coverage import estimate_coverage
from graspbench.perception.distortion import ideal_view

_COARSENESS = 4
_CROP_MARGIN = 12
_FULL_FRACTION = 0.9
_NOISY = 6.0
_OUTLINE_BLUR_PX = 0.7
_DOUBTFUL_FRACTION = 0.05
_DEEPER_PX = 3
_DOUBTFUL_BLUR_PX = 0.8
_FAINT = 0.7
_MAX_REFINEMENTS = 6
_MOVED_FRACTION = 0.05
_SURE_SHARE = 0.5


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
    fill_holes: Annotated[
        bool, Field(description="Fill all holes; else those that do not show the background for sure")
    ] = False
    hole_fraction: Annotated[
        float, Field(ge=0, lt=1, description="Smallest hole, fraction of the filled silhouette's area")
    ] = 0.015
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
        return holes(self.mask[top:bottom, left:right])[0]


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
    found = _describe(
        silhouette.station,
        filled,
        silhouette.window,
        coverage,
        silhouette.camera,
        fills=silhouette.margin_px > 0,
    )
    return replace(found, margin_px=silhouette.margin_px)


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
    small = [_shrink(view.image) for view in ideal if view.mask is None]
    if not small:
        return tuple(_given(view) for view in ideal)
    background = learn_background(small, parameters.darkest_shadow, parameters.border_fraction)
    coarse = iter(small)
    return tuple(
        _silhouette(view, next(coarse), background, parameters) if view.mask is None else _given(view)
        for view in ideal
    )


def _given(view: View) -> Silhouette:
    """Describe the mask that came with a view; where it meets the border, the object goes on beyond."""
    mask, k = view.mask, view.camera.intrinsics
    assert mask is not None, "only views with a mask are asked"
    if not mask.any():
        raise ImageError(f"the mask of station {view.station} is empty", station=view.station)
    sides = (mask[0].any(), mask[-1].any(), mask[:, 0].any(), mask[:, -1].any())
    if not any(sides):
        return _described_mask(view.station, mask, view.camera)
    # Beyond a side that cuts the object nothing is known, so that nothing there may be carved away.
    margin = max(k.width, k.height) // 2
    wide = np.pad(mask, margin)
    wide[1:margin, 1:-1] |= sides[0]
    wide[-margin:-1, 1:-1] |= sides[1]
    wide[1:-1, 1:margin] |= sides[2]
    wide[1:-1, -margin:-1] |= sides[3]
    k = replace(k, width=wide.shape[1], height=wide.shape[0], cx=k.cx + margin, cy=k.cy + margin)
    found = _described_mask(view.station, wide, Camera(k, view.camera.transform_camera_to_world))
    seen = np.argwhere(mask).mean(axis=0)[::-1] + 0.5
    return replace(found, margin_px=margin, centroid=seen + margin)


def _described_mask(station: str, mask: BoolArray, camera: Camera) -> Silhouette:
    whole = (0, mask.shape[0], 0, mask.shape[1])
    return _describe(station, mask, whole, mask.astype(np.float32), camera, fills=True)


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
    return _describe(station, mask, (0, height, 0, width), mask.astype(np.float32), camera)


def _describe(
    station: str,
    inside: BoolArray,
    window: tuple[int, int, int, int],
    coverage: FloatImage,
    camera: Camera,
    *,
    fills: bool = False,
) -> Silhouette:
    """Describe a mask and its coverage, given on a window of the image; ``fills``: it may fill the image."""
    height, width = camera.intrinsics.height, camera.intrinsics.width
    per_row, per_column = inside.sum(axis=1), inside.sum(axis=0)
    rows, columns = np.flatnonzero(per_row), np.flatnonzero(per_column)
    if len(rows) == 0:
        raise _empty(station)
    area = float(per_row.sum())
    if area > _FULL_FRACTION * height * width and not fills:
        raise _full(station)
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


def _silhouette(
    view: View, coarse: ImageArray, background: Background, parameters: SilhouetteParameters
) -> Silhouette:
    """Find the object in one view: roughly in a small copy, then exactly around what was found."""
    station = view.station
    height, width = view.image.shape[:2]
    top, bottom, left, right = _locate(station, coarse, background, parameters)
    window = (
        max(top - _CROP_MARGIN, 0),
        min(bottom + _CROP_MARGIN, height),
        max(left - _CROP_MARGIN, 0),
        min(right + _CROP_MARGIN, width),
    )
    crop = np.ascontiguousarray(view.image[window[0] : window[1], window[2] : window[3]])
    calm = cv2.medianBlur(crop, 3)
    blob, doubtful = _blob(station, calm, background, parameters)
    if np.count_nonzero(blob) < parameters.smallest_area_px:
        raise _empty(station)
    noisy = float(background.distance(crop[::3, ::3])[~blob[::3, ::3]].mean()) > _NOISY
    steps = _MAX_REFINEMENTS if doubtful or noisy else 1
    inside, coverage = _refine(calm if noisy else crop, blob, steps, parameters)
    return _describe(station, inside, window, coverage, view.camera)


def _refine(
    image: ImageArray, blob: BoolArray, steps: int, parameters: SilhouetteParameters
) -> tuple[BoolArray, FloatImage]:
    """Move the outline, a pixel at a step, to where the colour is half way between both sides."""
    kept = fill_holes(blob) & ~blob
    for _ in range(steps):
        coverage = estimate_coverage(image, blob)
        # Smoothing settles the pixels that are covered by half along the outline they belong to.
        half = cv2.GaussianBlur(coverage, (5, 5), _OUTLINE_BLUR_PX) >= 0.5
        inside = largest_blob(half.astype(np.uint8))
        if inside is None:
            return blob, coverage
        inside = fill_holes_but(inside, kept)
        moved = np.count_nonzero(inside != blob)
        outline = np.count_nonzero((coverage > 0.0) & (coverage < 1.0))
        blob = inside
        if moved <= _MOVED_FRACTION * outline:
            break
    return blob, coverage


def _blob(
    station: str, image: ImageArray, background: Background, parameters: SilhouetteParameters
) -> tuple[BoolArray, bool]:
    """Return the largest blob of colours far from the background, and whether its outline is in doubt."""
    distance = background.distance(image)
    threshold = _threshold(distance, background.noise, parameters)
    blob = largest_blob(_clean(distance > threshold, parameters))
    doubtful = blob is None or _share(distance[blob] < 1.5 * threshold) > _DOUBTFUL_FRACTION
    if doubtful:
        # Object and background look alike: average the noise over more pixels, close deeper bays.
        distance = background.distance(cv2.GaussianBlur(image, (0, 0), _DOUBTFUL_BLUR_PX))
        mask = distance > max(_FAINT * threshold, background.noise)
        deeper = parameters.dilation_px + _DEEPER_PX
        blob = largest_blob(close(_clean(mask, parameters), deeper))
    if blob is None:
        raise _empty(station)
    return fill_holes_but(blob, _true_holes(blob, distance, background.noise, parameters)), doubtful


def _true_holes(
    blob: BoolArray, distance: FloatImage, noise: float, parameters: SilhouetteParameters
) -> BoolArray:
    """Return the holes that are large enough and mostly show the background, shape (h, w)."""
    true = np.zeros_like(blob)
    if parameters.fill_holes:
        return true
    near = max(noise, _SURE_SHARE * parameters.contrast)
    count, labels = holes(blob)
    smallest = parameters.hole_fraction * (np.count_nonzero(blob) + np.count_nonzero(labels))
    for hole in range(1, count + 1):
        inside = labels == hole
        # On its rim object and background mix.
        if np.count_nonzero(inside) >= smallest and np.median(distance[inside]) <= near:
            true |= inside
    return true


def _locate(
    station: str, coarse: ImageArray, background: Background, parameters: SilhouetteParameters
) -> tuple[int, int, int, int]:
    """Return the rows and columns (first, end) of the object, found in a small copy of the image."""
    distance = background.distance(coarse)
    threshold = _threshold(distance, background.noise, parameters)
    faint = distance > max(_FAINT * threshold, background.noise)
    mask = close(faint.astype(np.uint8), 1)
    if _share(mask) > _FULL_FRACTION:
        raise _full(station)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    # Faint parts join a blob, but only what is distinct makes one.
    areas = np.bincount(labels[distance > threshold], minlength=count)[1:] * _COARSENESS**2
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


def _clean(mask: BoolArray, parameters: SilhouetteParameters) -> ByteMask:
    """Remove specks and close gaps."""
    return clean(mask.astype(np.uint8), parameters.erosion_px, parameters.dilation_px)


def _share(mask: npt.NDArray[np.generic]) -> float:
    """Return the fraction of the elements that are set."""
    return int(np.count_nonzero(mask)) / max(mask.size, 1)


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
