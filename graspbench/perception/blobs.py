"""Connected blobs of binary images, and the morphology that cleans them."""

from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from graspbench.arrays import BoolArray, IntArray

ByteMask: TypeAlias = npt.NDArray[np.uint8]


def clean(mask: ByteMask, erosion_px: int, dilation_px: int) -> ByteMask:
    """Erode and dilate by one radius (an opening), then dilate and erode by the other (a closing)."""
    if erosion_px:
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc(erosion_px))
    return close(mask, dilation_px) if dilation_px else mask


def close(mask: ByteMask, radius_px: int) -> ByteMask:
    """Dilate and erode: gaps and bays narrower than twice the radius are closed."""
    closed: ByteMask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, disc(radius_px))
    return closed


def disc(radius: int) -> ByteMask:
    """Return a disc as a structuring element, shape (2 radius + 1, 2 radius + 1)."""
    kernel: ByteMask = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1,) * 2)
    return kernel


def largest_blob(mask: ByteMask) -> BoolArray | None:
    """Keep the largest 4-connected blob; None if the mask is empty."""
    count, labels = cv2.connectedComponents(mask, connectivity=4)
    if count < 2:
        return None
    largest = 1 if count == 2 else 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
    blob: BoolArray = labels == largest
    return blob


def fill_holes(mask: BoolArray) -> BoolArray:
    """Fill every hole that does not open to the image's border."""
    empty = (~mask).astype(np.uint8)
    outside = cv2.copyMakeBorder(empty, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1)
    cv2.floodFill(outside, None, (0, 0), 2, flags=4)
    filled: BoolArray = outside[1:-1, 1:-1] != 2
    return filled


def hole_count(mask: BoolArray) -> int:
    """Return the number of holes that do not open to the image's border, as `holes` does, but fast."""
    _, tree = cv2.findContours(mask.view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    # A row is next, previous, child, parent: of two levels, those with a parent are the holes' borders.
    return 0 if tree is None else int(np.count_nonzero(tree[0, :, 3] >= 0))


def holes(mask: BoolArray) -> tuple[int, IntArray]:
    """Return the number of holes that do not open to the image's border, and each pixel's hole.

    Returns:
        Their number, and an image with 1, 2, ... in the holes and 0 elsewhere.
    """
    inner = fill_holes(mask) & ~mask
    count, labels = cv2.connectedComponents(inner.astype(np.uint8), connectivity=4)
    return count - 1, labels.astype(np.int64)


def fill_holes_but(mask: BoolArray, kept: BoolArray) -> BoolArray:
    """Fill every hole that has no pixel in ``kept``, shape (h, w) like the mask."""
    if not kept.any():
        return fill_holes(mask)
    count, labels = holes(mask)
    filled: BoolArray = mask | ((labels > 0) & ~np.isin(labels, np.unique(labels[kept])))
    return filled if count else mask
