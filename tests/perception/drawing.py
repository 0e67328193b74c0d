"""Synthetic images with shapes of known coverage."""

import numpy as np

from graspbench.perception import Camera, CameraParameters, View, look_at

INTRINSICS = CameraParameters().intrinsics
TABLE, OBJECT = np.array([30.0, 115.0, 65.0]), np.array([200.0, 80.0, 50.0])


def disc_coverage(u, v, radius, subdivisions=5):
    """Return how much of each pixel of a 640 x 480 image a disc covers."""
    n = subdivisions
    x, y = (np.arange(640 * n) + 0.5) / n, (np.arange(480 * n) + 0.5) / n
    inside = (x - u) ** 2 + (y[:, None] - v) ** 2 < radius**2
    return inside.reshape(480, n, 640, n).mean(axis=(1, 3))


def paint(coverage, colour=OBJECT, background=TABLE, noise=0.0, seed=0):
    """Mix two colours by coverage and add Gaussian noise."""
    share = coverage[..., None]
    image = share * colour + (1.0 - share) * background
    image = image + noise * np.random.default_rng(seed).standard_normal(image.shape)
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


def view_of(image, station="outer-3"):
    """Wrap an image as a view."""
    pose = look_at(np.array([0.3, 0.0, 0.4]), np.zeros(3))
    return View(station, image, Camera(INTRINSICS, pose))
