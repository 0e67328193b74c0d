"""What the background looks like, learned from the images' borders, and how far a colour is from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from graspbench.arrays import BoolArray, FloatArray, ImageArray, IntArray
from graspbench.compiled import compiled

FloatImage = npt.NDArray[np.float32]

_MAX_SAMPLES = 5000
_MAX_MODES = 6
_SMALLEST_SHARE = 0.02
_SMALLEST_SHARE_OF_ONE = 0.08
_SMALLEST_SHARE_OF_IMAGES = 0.3
_MODE_RADIUS = 14.0
_REFINEMENTS = 4


@dataclass(frozen=True, eq=False)
class Background:
    """The colours of a background under uneven light.

    A colour belongs to the background when it is one of a few modes, darkened no more than a shadow
    does and brightened no more than the light's unevenness does. Distances are Euclidean in RGB, in
    grey levels of 0 to 255.

    Attributes:
        modes: One row a mode: red, green, blue, and the smallest and largest accepted multiple of it,
            shape (k, 5).
        noise: Distance that 99 in 100 background pixels stay under.
        colour: Median colour of the border, shape (3,).
    """

    modes: npt.NDArray[np.float32]
    noise: float
    colour: FloatArray

    def distance(self, image: ImageArray) -> FloatImage:
        """Return each pixel's colour distance to the background.

        Args:
            image: RGB, shape (h, w, 3).

        Returns:
            Grey levels, shape (h, w).
        """
        flat = np.ascontiguousarray(image).reshape(-1, 3)
        distance: FloatImage = _distances(flat, self.modes).reshape(image.shape[:2])
        return distance


def learn_background(
    images: Sequence[ImageArray], darkest_shadow: float, border_fraction: float
) -> Background:
    """Learn the background from the borders of one or several images.

    Modes are found one after the other: the first is the median colour; each next one is the densest
    colour among the border's pixels that no mode explains yet. What only few images show at their
    border, or one image on a small part of it, is an object in the way and no background.

    Args:
        images: RGB, shape (h, w, 3) each, small copies will do.
        darkest_shadow: Fraction of a mode's brightness left in the deepest shadow.
        border_fraction: Width of the border that is looked at, as a fraction of the image's height.
    """
    borders = [_border(image, border_fraction) for image in images]
    step = max(1, sum(map(len, borders)) // _MAX_SAMPLES)
    samples = np.concatenate([border[::step] for border in borders])
    source = np.repeat(np.arange(len(borders)), [len(border[::step]) for border in borders])
    pixels = samples.astype(np.float32)
    modes = np.empty((0, 5), dtype=np.float32)
    explained = np.zeros(len(pixels), dtype=np.bool_)
    open_ = ~explained
    for _ in range(_MAX_MODES):
        if len(modes) and open_.mean() < _SMALLEST_SHARE:
            break
        mode = _next_mode(pixels[open_], darkest_shadow)
        near = open_ & (_distances(samples, mode[None]) <= _MODE_RADIUS)
        if not len(modes) or _is_common(near, source, len(borders)):
            modes = np.vstack((modes, mode))
            explained |= near
        open_ &= ~near
        if not near.any():
            break
    distances = _distances(samples, modes)
    noise = float(np.percentile(distances[explained] if explained.any() else distances, 99.0))
    return Background(modes, noise, np.median(pixels, axis=0).astype(np.float64))


def _is_common(near: BoolArray, source: IntArray, images: int) -> bool:
    """Tell whether enough of the border, or of several images' borders, shows a colour."""
    if images == 1:
        return float(near.mean()) > _SMALLEST_SHARE_OF_ONE
    shares = np.bincount(source[near], minlength=images) / np.bincount(source, minlength=images)
    several = max(2.0, _SMALLEST_SHARE_OF_IMAGES * images)
    return int(np.count_nonzero(shares > _SMALLEST_SHARE)) >= several


def _next_mode(pixels: FloatImage, darkest_shadow: float) -> FloatImage:
    """Return the mode that explains most of some pixels, shape (5,)."""
    colour = np.median(pixels, axis=0)
    near = pixels
    for _ in range(_REFINEMENTS):
        multiple = pixels @ colour / max(float(colour @ colour), 1.0)
        offset = np.linalg.norm(pixels - multiple[:, None] * colour, axis=1)
        close = (offset <= max(_MODE_RADIUS, float(np.median(offset)))) & (np.abs(multiple - 1.0) < 0.5)
        if not close.any():
            break
        near = pixels[close]
        colour = np.median(near, axis=0)
    multiple = near @ colour / max(float(colour @ colour), 1.0)
    low, high = np.percentile(multiple, (1.0, 99.0))
    mode = np.array((*colour, min(low, 1.0) * darkest_shadow, max(high, 1.0)), dtype=np.float32)
    return mode


def _border(image: ImageArray, fraction: float) -> ImageArray:
    """Return the pixels of the border, shape (n, 3)."""
    height, width = image.shape[:2]
    margin = max(1, round(fraction * min(height, width)))
    return np.concatenate(
        (
            image[:margin].reshape(-1, 3),
            image[-margin:].reshape(-1, 3),
            image[margin:-margin, :margin].reshape(-1, 3),
            image[margin:-margin, -margin:].reshape(-1, 3),
        )
    )


@compiled
def _distances(pixels: ImageArray, modes: FloatImage) -> FloatImage:
    """Distance of colours to the nearest mode's brightness segment, shape (n,)."""
    out = np.empty(len(pixels), dtype=np.float32)
    inverse = np.empty(len(modes), dtype=np.float32)
    for k in range(len(modes)):
        square = modes[k, 0] ** 2 + modes[k, 1] ** 2 + modes[k, 2] ** 2
        inverse[k] = np.float32(1.0) / max(square, np.float32(1.0))
    for i in range(len(pixels)):
        red, green, blue = np.float32(pixels[i, 0]), np.float32(pixels[i, 1]), np.float32(pixels[i, 2])
        best = np.float32(1e12)
        for k in range(len(modes)):
            along = (red * modes[k, 0] + green * modes[k, 1] + blue * modes[k, 2]) * inverse[k]
            along = min(max(along, modes[k, 3]), modes[k, 4])
            dr, dg, db = red - along * modes[k, 0], green - along * modes[k, 1], blue - along * modes[k, 2]
            best = min(best, dr * dr + dg * dg + db * db)
        out[i] = np.sqrt(best)
    return out
