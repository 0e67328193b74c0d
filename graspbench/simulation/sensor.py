"""What light and electronics do to an image: uneven light, blur, noise."""

import math
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from graspbench.arrays import ImageArray
from graspbench.compiled import compiled
from graspbench.simulation.scene import SceneParameters

_LEVELS = 1 << 16


def expose(image: ImageArray, scene: SceneParameters, generator: np.random.Generator) -> ImageArray:
    """Return the image as the sensor delivers it.

    Args:
        image: RGB, shape (h, w, 3).
        scene: Blur, light gradient and noise.
        generator: Draws the noise.
    """
    if scene.blur_px > 0.0:
        image = cv2.GaussianBlur(image, (0, 0), scene.blur_px)
    if not (scene.light_gradient or scene.noise_std or scene.salt_pepper):
        return image
    height, width = image.shape[:2]
    direction = math.radians(scene.light_gradient_deg)
    along_u, along_v = math.cos(direction), math.sin(direction)
    span = abs(along_u) * width + abs(along_v) * height
    slope_u, slope_v = (scene.light_gradient * a / span for a in (along_u, along_v))
    # A table of the normal distribution's quantiles turns uniform bits into noise at little cost.
    if scene.noise_std > 0.0:
        quantiles = _normal_quantiles() * np.float32(scene.noise_std)
        bits = generator.integers(0, _LEVELS, image.shape, dtype=np.uint16)
    else:
        quantiles, bits = np.zeros(1, dtype=np.float32), np.zeros((1, 1, 3), dtype=np.uint16)
    out = np.empty_like(image)
    _expose(image, np.float32(slope_u), np.float32(slope_v), quantiles, bits, out)
    if scene.salt_pepper > 0.0:
        stuck = generator.random((height, width), dtype=np.float32)
        out[stuck < scene.salt_pepper / 2.0] = 0
        out[stuck > 1.0 - scene.salt_pepper / 2.0] = 255
    return out


@lru_cache(maxsize=1)
def _normal_quantiles() -> npt.NDArray[np.float32]:
    """Return the standard normal distribution's quantiles at the middle of each level."""
    return ndtri((np.arange(_LEVELS) + 0.5) / _LEVELS).astype(np.float32)


@compiled
def _expose(
    image: ImageArray,
    slope_u: np.float32,
    slope_v: np.float32,
    quantiles: npt.NDArray[np.float32],
    bits: npt.NDArray[np.uint16],
    out: ImageArray,
) -> None:
    """Scale brightness linearly across the image (1 in its middle) and add noise."""
    height, width = image.shape[0], image.shape[1]
    noisy = len(quantiles) > 1
    half = np.float32(0.5)
    for r in range(height):
        row = np.float32(1.0) + slope_v * (np.float32(r) + half - np.float32(height) * half)
        for c in range(width):
            factor = row + slope_u * (np.float32(c) + half - np.float32(width) * half)
            for k in range(3):
                value = np.float32(image[r, c, k]) * factor + half
                if noisy:
                    value += quantiles[bits[r, c, k]]
                out[r, c, k] = np.uint8(min(max(value, np.float32(0.0)), np.float32(255.0)))
