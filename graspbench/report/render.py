"""A small software renderer: shaded meshes with a depth buffer, ready for a figure.

Matplotlib's 3-D axes sort whole artists by depth, so a path that passes behind a surface is drawn
either all in front or all behind; and no display or GPU may be asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from graspbench.arrays import BoolArray, FloatArray, ImageArray
from graspbench.report import style
from graspbench.report.raster import Pixels, draw_triangles, fill_triangles, lay_over
from graspbench.report.solids import Solid, merge

_SUPERSAMPLING = 2
_LINE_PX = 0.45  # half the width of the network's lines
_TOUCHING = 0.02  # of the distance: points on a surface are seen although it is as near as they
_PROBE = (96, 72)  # pixels in which it is looked what hides what


@dataclass(frozen=True)
class Viewpoint:
    """A perspective view that looks at a target.

    Attributes:
        target: Point in the middle of the picture, shape (3,).
        azimuth_deg: Where the eye stands around the vertical, from the x axis.
        elevation_deg: Its height over the horizon.
        radius_m: Radius around the target that is seen for certain.
        field_deg: Full opening angle.
    """

    target: FloatArray
    azimuth_deg: float
    elevation_deg: float
    radius_m: float
    field_deg: float = 24.0

    @property
    def direction(self) -> FloatArray:
        """Unit vector from the target to the eye, shape (3,)."""
        a, e = np.radians(self.azimuth_deg), np.radians(self.elevation_deg)
        return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])

    @property
    def distance_m(self) -> float:
        """Distance of the eye to the target."""
        return float(self.radius_m / np.sin(np.radians(self.field_deg / 2)))

    @property
    def axes(self) -> FloatArray:
        """Rows: right, down, forward, shape (3, 3)."""
        forward = -self.direction
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return np.stack((right, np.cross(forward, right), forward))

    def pixels_per_m(self, width: int, height: int) -> float:
        """Return the scale of a picture at the target."""
        half = 0.5 * min(width, height) / np.tan(np.radians(self.field_deg / 2))
        return float(half / self.distance_m)

    def project(self, points: FloatArray, width: int, height: int) -> FloatArray:
        """Return (u, v, 1 / depth) of world points, shape (n, 3)."""
        eye = self.target + self.distance_m * self.direction
        local = (points - eye) @ self.axes.T
        focal = 0.5 * min(width, height) / np.tan(np.radians(self.field_deg / 2))
        inverse = 1.0 / local[:, 2]
        u = focal * local[:, 0] * inverse + 0.5 * width
        v = focal * local[:, 1] * inverse + 0.5 * height
        return np.column_stack((u, v, inverse))


def render(
    solids: Sequence[Solid],
    marks: Sequence[Solid],
    view: Viewpoint,
    size: tuple[int, int],
    *,
    ground_height_m: float | None = None,
    ghost: float = 0.4,
) -> ImageArray:
    """Draw solids and, over them, marks that shine through faintly where a solid hides them.

    Args:
        solids: What hides things.
        marks: Points and paths that must be found.
        view: Where from.
        size: Width and height of the image, pixels of the layout (see `style.Look.resolution`).
        ground_height_m: Height of a table top that receives a soft shadow; None for none.
        ghost: How much of a hidden mark is seen, from 0 to 1.

    Returns:
        RGB image on white, shape (height, width, 3).
    """
    resolution = style.look().resolution
    size = (size[0] * resolution, size[1] * resolution)
    finer = _SUPERSAMPLING if resolution == 1 else 1  # print is fine enough as it is
    width, height = size[0] * finer, size[1] * finer
    image = np.full((height, width, 3), 1.0, dtype=np.float32)
    if ground_height_m is not None:
        _drop_shadow(image, [*solids, *marks], view, ground_height_m)
    line_px = _LINE_PX * finer * resolution
    body_color, body_depth = _layer(solids, view, width, height, line_px, ambient=0.0)
    mark_color, mark_depth = _layer(marks, view, width, height, line_px, ambient=0.35)
    lay_over(image, body_color, body_depth, mark_color, mark_depth, ghost)
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    pixels: ImageArray = np.clip(small * 255.0 + 0.5, 0, 255).astype(np.uint8)
    return pixels


@dataclass(frozen=True)
class Visibility:
    """What is seen from somewhere.

    Attributes:
        body: Share of the body's outline that nothing hides.
        points: Whether each point is seen, shape (n,).
    """

    body: float
    points: BoolArray


def visibility(body: Solid, others: Sequence[Solid], points: FloatArray, view: Viewpoint) -> Visibility:
    """Return how much of a body and of points on it is seen past other solids.

    Args:
        body: The body.
        others: What may hide it.
        points: Shape (n, 3).
        view: Where from.
    """
    width, height = _PROBE
    _, mine = _layer([body], view, width, height, 0.0, ambient=0.0)
    _, before = _layer(others, view, width, height, 0.0, ambient=0.0)
    outline = mine > 0.0
    free = float((mine >= before)[outline].mean()) if outline.any() else 0.0
    screen = view.project(points, width, height)
    column = np.clip(screen[:, 0].astype(int), 0, width - 1)
    row = np.clip(screen[:, 1].astype(int), 0, height - 1)
    nearest = np.maximum(mine, before)[row, column]
    return Visibility(free, screen[:, 2] >= nearest * (1.0 - _TOUCHING))


def _layer(
    solids: Sequence[Solid], view: Viewpoint, width: int, height: int, line_px: float, ambient: float
) -> tuple[Pixels, Pixels]:
    color = np.zeros((height, width, 3), dtype=np.float32)
    depth = np.zeros((height, width), dtype=np.float32)  # 1 / distance: nothing there is 0
    if solids:
        solid = merge(solids)
        screen = view.project(solid.points, width, height)
        lights = np.stack((view.direction, _light(view)))
        draw_triangles(
            screen,
            solid.normals,
            solid.colors,
            solid.faces,
            solid.edges,
            lights,
            line_px,
            ambient,
            color,
            depth,
        )
    return color, depth


def _light(view: Viewpoint) -> FloatArray:
    """Direction to the key light: over the viewer's left shoulder."""
    right, down, _ = view.axes
    light = view.direction - 0.75 * right - 0.9 * down
    unit: FloatArray = light / np.linalg.norm(light)
    return unit


def _drop_shadow(image: Pixels, solids: Sequence[Solid], view: Viewpoint, ground_m: float) -> None:
    """Darken the table top where the solids stand over it."""
    height, width = image.shape[:2]
    solid = merge(solids)
    light = _light(view) + np.array([0.0, 0.0, 1.2])
    above = np.maximum(solid.points[:, 2:] - ground_m, 0.0)
    fallen = solid.points - above * light / light[2]
    fallen[:, 2] = ground_m
    screen = np.round(view.project(fallen, width, height)[:, :2]).astype(np.int32)
    mask = np.zeros((height, width), dtype=np.uint8)
    fill_triangles(screen, solid.faces, mask)
    half = cv2.resize(mask, (width // 4, height // 4), interpolation=cv2.INTER_AREA).astype(np.float32)
    soft = cv2.GaussianBlur(half, (0, 0), 0.008 * width)
    soft = cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR)
    across = np.minimum(1.0, np.minimum(np.arange(width), np.arange(width)[::-1]) / (0.08 * width))
    down = np.minimum(1.0, np.minimum(np.arange(height), np.arange(height)[::-1]) / (0.08 * height))
    soft *= np.outer(down, across).astype(np.float32)  # no edge where the picture ends
    image *= (1.0 - 0.30 * soft)[..., None]
