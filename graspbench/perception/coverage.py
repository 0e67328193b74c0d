"""How much of a pixel the object covers, from the pixel's colour."""

import cv2
import numpy as np
import numpy.typing as npt

from graspbench.arrays import BoolArray, ImageArray
from graspbench.compiled import compiled

_REACH = 2


def estimate_coverage(image: ImageArray, blob: BoolArray) -> npt.NDArray[np.float32]:
    """Estimate the fraction of each pixel that the object covers.

    A pixel that object and background share has a colour between theirs. Both are taken from the
    neighbourhood, so that shading and shadow matter little. One pixel on both sides of the blob's
    outline is estimated; further inside the coverage is 1, further outside 0.

    Args:
        image: RGB, shape (h, w, 3).
        blob: The object to within a pixel, shape (h, w).

    Returns:
        Shape (h, w).
    """
    flat = blob.astype(np.uint8)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    # 0 background, 1 outside the outline, 2 inside it, 3 solid.
    zone = flat + cv2.erode(flat, cross) + cv2.dilate(flat, cross)
    coverage = np.empty(blob.shape, dtype=np.float32)
    _estimate(np.ascontiguousarray(image), zone, coverage)
    return coverage


@compiled
def _estimate(image: ImageArray, zone: npt.NDArray[np.uint8], out: npt.NDArray[np.float32]) -> None:
    """Place the colour of each pixel of zones 1 and 2 between the mean colours of zones 0 and 3 nearby."""
    height, width = zone.shape
    front, back = np.empty(3, dtype=np.float32), np.empty(3, dtype=np.float32)
    for r in range(height):
        for c in range(width):
            if zone[r, c] == 0 or zone[r, c] == 3:
                out[r, c] = np.float32(zone[r, c] == 3)
                continue
            front[:], back[:] = np.float32(0.0), np.float32(0.0)
            fronts = backs = 0
            for i in range(max(r - _REACH, 0), min(r + _REACH + 1, height)):
                for j in range(max(c - _REACH, 0), min(c + _REACH + 1, width)):
                    if zone[i, j] == 3:
                        fronts += 1
                        for k in range(3):
                            front[k] += np.float32(image[i, j, k])
                    elif zone[i, j] == 0:
                        backs += 1
                        for k in range(3):
                            back[k] += np.float32(image[i, j, k])
            # Parts too thin for a solid core have nothing to compare with: there the blob stands.
            share = np.float32(zone[r, c] == 2)
            if fronts > 0 and backs > 0:
                along = square = np.float32(0.0)
                for k in range(3):
                    b = back[k] / np.float32(backs)
                    step = front[k] / np.float32(fronts) - b
                    along += (np.float32(image[r, c, k]) - b) * step
                    square += step * step
                if square > np.float32(1.0):
                    share = min(max(along / square, np.float32(0.0)), np.float32(1.0))
            out[r, c] = share
