"""Where in each image the object is: the background is learned, what differs from it is the object."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from graspbench.arrays import BoolArray, ImageArray
from graspbench.errors import ImageError
from graspbench.perception.background import Background, FloatImage, learn_background
from graspbench.perception.blobs import (
    ByteMask,
    clean,
    close,
    fill_holes,
    fill_holes_but,
    holes,
    largest_blob,
)
from graspbench.perception.camera import View
from graspbench.perception.coverage import estimate_coverage
from graspbench.perception.distortion import ideal_view
from graspbench.perception.given_masks import given_silhouette
from graspbench.perception.silhouette import FULL_FRACTION, Silhouette, describe, fills_image, no_object

_COARSENESS = 4
_CROP_MARGIN = 12
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
        return tuple(given_silhouette(view) for view in ideal)
    background = learn_background(small, parameters.darkest_shadow, parameters.border_fraction)
    coarse = iter(small)
    return tuple(
        given_silhouette(view)
        if view.mask is not None
        else _silhouette(view, next(coarse), background, parameters)
        for view in ideal
    )


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
        raise no_object(station)
    noisy = float(background.distance(crop[::3, ::3])[~blob[::3, ::3]].mean()) > _NOISY
    steps = _MAX_REFINEMENTS if doubtful or noisy else 1
    inside, coverage = _refine(calm if noisy else crop, blob, steps, parameters)
    return describe(station, inside, window, coverage, view.camera)


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
        raise no_object(station)
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
    if _share(mask) > FULL_FRACTION:
        raise fills_image(station)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    # Faint parts join a blob, but only what is distinct makes one.
    areas = np.bincount(labels[distance > threshold], minlength=count)[1:] * _COARSENESS**2
    if count < 2 or areas.max() < parameters.smallest_area_px:
        raise no_object(station)
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
