"""What the table top looks like: its pattern, the light on it, the object's shadow."""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from graspbench.arrays import FloatArray, ImageArray
from graspbench.compiled import compiled
from graspbench.errors import ConfigurationError
from graspbench.perception.camera import Intrinsics
from graspbench.simulation.colours import SceneColours
from graspbench.simulation.scene import SceneParameters

FloatImage = npt.NDArray[np.float32]

_SIZE_M = 2.0
_TEXELS = 1280
_SUBPIXEL_BITS = 4


@dataclass(frozen=True, eq=False)
class Table:
    """The lit table top as an image, and what lies beyond it.

    Attributes:
        texture: RGB, row i and column j at x = (j + 0.5) / n * size - size / 2, y likewise from the
            row, shape (n, n, 3).
        size_m: Side of the square, centred at the world's origin.
        beyond: Colour beyond the table, RGB, shape (3,).
        varied: First row, end row, first column, end column of the texels that differ from the first;
            drawing looks up no others.
    """

    texture: ImageArray
    size_m: float
    beyond: ImageArray
    varied: tuple[int, int, int, int]

    def image(self, intrinsics: Intrinsics, camera_to_world: FloatArray) -> ImageArray:
        """Return the empty table as a pinhole camera sees it, shape (h, w, 3)."""
        k = intrinsics
        image = np.empty((k.height, k.width, 3), dtype=np.uint8)
        to_ray = np.array([[1 / k.fx, 0, -k.cx / k.fx], [0, 1 / k.fy, -k.cy / k.fy], [0, 0, 1]])
        _draw(
            self.texture,
            len(self.texture) / self.size_m,
            self.beyond,
            np.array(self.varied, dtype=np.float32),
            camera_to_world[:3, :3] @ to_ray,
            np.ascontiguousarray(camera_to_world[:3, 3]),
            image,
        )
        return image


def build_table(
    scene: SceneParameters, colours: SceneColours, vertices: FloatArray, faces: npt.ArrayLike, seed: int
) -> Table:
    """Draw the table top with its pattern, light and shadow.

    Args:
        scene: Pattern and light.
        colours: Of table and wall.
        vertices: The object's vertices in the world, shape (n, 3).
        faces: Its triangles, shape (m, 3).
        seed: Draws the random patterns.

    Raises:
        ConfigurationError: ``scene.table`` is neither a pattern nor a readable image.
    """
    lamp = scene.diffuse * math.sin(math.radians(scene.light_elevation_deg))
    pattern = _pattern(scene, colours, np.random.default_rng(seed))
    plain = pattern.shape[0] == 1
    texture = np.empty((_TEXELS, _TEXELS, 3), dtype=np.uint8)
    texture[:] = _bytes(pattern * np.float32(scene.ambient + lamp))
    varied = (0, 0, 0, 0) if plain else (0, _TEXELS, 0, _TEXELS)
    if scene.shadow > 0.0 and lamp > 0.0:
        (top, bottom, left, right), shade = _shadow(scene, vertices, np.asarray(faces))
        light = scene.ambient + np.float32(lamp) * (1.0 - np.float32(scene.shadow) * shade[..., None])
        shaded = pattern if plain else pattern[top:bottom, left:right]
        texture[top:bottom, left:right] = _bytes(shaded * light)
        varied = (top, bottom, left, right) if plain else varied
    beyond = _bytes(np.asarray(colours.wall, dtype=np.float32) * np.float32(scene.ambient + lamp))
    return Table(texture, _SIZE_M, beyond, varied)


def _bytes(colours: npt.NDArray[np.floating]) -> ImageArray:
    """Turn colours from 0 to 1 into bytes."""
    return np.ascontiguousarray(np.clip(colours * 255.0 + 0.5, 0.0, 255.0).astype(np.uint8))


def _pattern(scene: SceneParameters, colours: SceneColours, generator: np.random.Generator) -> FloatImage:
    """Return the unlit colours of the table top, shape (1, 1, 3) or (n, n, 3)."""
    first, second = (np.asarray(c, dtype=np.float32) for c in (colours.first, colours.second))
    if scene.table == "plain":
        return first[None, None]
    if scene.table in _PATTERNS:
        share = _PATTERNS[scene.table](scene, generator)[..., None]
        mixed: FloatImage = first * (1.0 - share) + second * share
        return mixed
    path = os.path.expanduser(scene.table)
    image = cv2.imread(path, cv2.IMREAD_COLOR) if os.path.isfile(path) else None
    if image is None:
        raise ConfigurationError(
            f"scene.table '{scene.table}' is no pattern and no readable image",
            remedy=f"choose plain, {', '.join(_PATTERNS)}, or an image file",
            table=scene.table,
        )
    scaled = cv2.resize(image, (_TEXELS, _TEXELS), interpolation=cv2.INTER_AREA)
    texture: FloatImage = scaled[..., ::-1].astype(np.float32) / np.float32(255.0)
    return texture


def _checker(scene: SceneParameters, _: np.random.Generator) -> FloatImage:
    """Squares of the pattern's size."""
    cell = np.floor((np.arange(_TEXELS) + 0.5) / _TEXELS * _SIZE_M / scene.table_pattern_m).astype(np.int64)
    share: FloatImage = ((cell[:, None] + cell) % 2).astype(np.float32)
    return share


def _wood(scene: SceneParameters, generator: np.random.Generator) -> FloatImage:
    """Long wavy fibres along x."""
    bands = _SIZE_M / scene.table_pattern_m
    warp = _noise(generator, round(bands / 4) + 2, 6) * 3.0 + _noise(generator, round(bands * 6), 12) * 0.4
    across = np.linspace(0.0, bands, _TEXELS, dtype=np.float32)[:, None]
    share: FloatImage = (0.5 + 0.5 * np.sin(2.0 * np.pi * (across + warp))).astype(np.float32)
    return share


def _speckle(scene: SceneParameters, generator: np.random.Generator) -> FloatImage:
    """Spots of all sizes up to the pattern's, as in granite."""
    cells = _SIZE_M / scene.table_pattern_m
    total = sum(_noise(generator, round(cells * 2**i) + 2, round(cells * 2**i) + 2) for i in range(4))
    share: FloatImage = np.clip(0.5 + 0.6 * np.asarray(total), 0.0, 1.0).astype(np.float32)
    return share


def _noise(generator: np.random.Generator, rows: int, columns: int) -> FloatImage:
    """Smooth noise of standard deviation about a half with so many cells, shape (n, n)."""
    grid = generator.uniform(-1.0, 1.0, (rows, columns)).astype(np.float32)
    smooth: FloatImage = cv2.resize(grid, (_TEXELS, _TEXELS), interpolation=cv2.INTER_CUBIC)
    return smooth


_PATTERNS: dict[str, Callable[[SceneParameters, np.random.Generator], FloatImage]] = {
    "checker": _checker,
    "wood": _wood,
    "speckle": _speckle,
}


def _shadow(
    scene: SceneParameters, vertices: FloatArray, faces: npt.NDArray[np.integer]
) -> tuple[tuple[int, int, int, int], FloatImage]:
    """Return how much of the lamp the object hides from the texels of a window, and the window.

    The window is first row, end row, first column, end column; outside it nothing is hidden.
    """
    elevation, azimuth = math.radians(scene.light_elevation_deg), math.radians(scene.light_azimuth_deg)
    slant = np.array([math.cos(azimuth), math.sin(azimuth)]) / math.tan(elevation)
    ground = (vertices[:, :2] - vertices[:, 2:] * slant + _SIZE_M / 2.0) * (_TEXELS / _SIZE_M)
    blur = scene.shadow_blur_m * _TEXELS / _SIZE_M
    margin = math.ceil(4.0 * blur) + 2
    left, top = np.clip(np.floor(ground.min(axis=0)).astype(int) - margin, 0, _TEXELS).tolist()
    right, bottom = np.clip(np.ceil(ground.max(axis=0)).astype(int) + margin, 0, _TEXELS).tolist()
    shade = np.zeros((bottom - top, right - left), dtype=np.uint8)
    # cv2 puts texel centres at whole numbers.
    corners = np.round((ground - (left, top) - 0.5) * 2**_SUBPIXEL_BITS).astype(np.int32)
    if shade.size:
        for triangle in corners[faces]:
            cv2.fillConvexPoly(shade, triangle, 255, lineType=cv2.LINE_8, shift=_SUBPIXEL_BITS)
        if blur > 0.1:
            shade = cv2.GaussianBlur(shade, (0, 0), blur)
    return (top, bottom, left, right), shade.astype(np.float32) / np.float32(255.0)


@compiled
def _draw(
    texture: ImageArray,
    texels_per_m: float,
    beyond: ImageArray,
    varied: FloatImage,
    pixel_to_direction: FloatArray,
    origin: FloatArray,
    out: ImageArray,
) -> None:
    """Look up where each pixel's ray meets the table, between the four nearest texels."""
    m, last = pixel_to_direction, np.float32(texture.shape[0] - 1)
    y_end, x_end = varied[1] - np.float32(1.0), varied[3] - np.float32(1.0)
    height = origin[2] * texels_per_m
    # Texel coordinates of the ray's foot are ratios of functions linear in u.
    shift_x = origin[0] * texels_per_m + texture.shape[0] / 2.0 - 0.5
    shift_y = origin[1] * texels_per_m + texture.shape[0] / 2.0 - 0.5
    step_x, step_y = np.float32(height * m[0, 0]), np.float32(height * m[1, 0])
    step_z = np.float32(-m[2, 0])
    origin_x, origin_y = np.float32(shift_x), np.float32(shift_y)
    one, half, levels = np.float32(1.0), np.float32(0.5), np.float32(65536.0)
    for r in range(out.shape[0]):
        v = r + 0.5
        start_x = np.float32(height * (m[0, 1] * v + m[0, 2]))
        start_y = np.float32(height * (m[1, 1] * v + m[1, 2]))
        start_z = np.float32(-(m[2, 1] * v + m[2, 2]))
        for c in range(out.shape[1]):
            u = np.float32(c) + half
            down = start_z + step_z * u
            x = y = np.float32(-1.0)
            if down > np.float32(1e-6):
                inverse = one / down
                x = origin_x + inverse * (start_x + step_x * u)
                y = origin_y + inverse * (start_y + step_y * u)
            if y >= varied[0] and y < y_end and x >= varied[2] and x < x_end:
                j, i = np.int32(x), np.int32(y)
                a, b = x - np.float32(j), y - np.float32(i)
                # Whole-number weights that add up to 2^16 keep the mixing exact and quick.
                w11 = np.int32(a * b * levels)
                w01 = np.int32(a * levels) - w11
                w10 = np.int32(b * levels) - w11
                w00 = np.int32(65536) - w01 - w10 - w11
                for k in range(3):
                    mixed = (
                        w00 * np.int32(texture[i, j, k])
                        + w01 * np.int32(texture[i, j + 1, k])
                        + w10 * np.int32(texture[i + 1, j, k])
                        + w11 * np.int32(texture[i + 1, j + 1, k])
                    )
                    out[r, c, k] = np.uint8((mixed + 32768) >> 16)
            elif x >= 0 and y >= 0 and x < last and y < last:
                for k in range(3):
                    out[r, c, k] = texture[0, 0, k]
            else:
                for k in range(3):
                    out[r, c, k] = beyond[k]
