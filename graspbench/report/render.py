"""A small software renderer: shaded meshes with a depth buffer, ready for a figure.

Matplotlib's 3-D axes sort whole artists by depth, so a path that passes behind a surface is drawn
either all in front or all behind; and no display or GPU may be asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from graspbench.arrays import BoolArray, FloatArray, ImageArray, IntArray
from graspbench.report import style
from graspbench.report.solids import Solid, merge

Pixels: TypeAlias = npt.NDArray[np.float32]

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
    _compose(image, body_color, body_depth, mark_color, mark_depth, ghost)
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
        _draw(
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
    _fill(screen, solid.faces, mask)
    half = cv2.resize(mask, (width // 4, height // 4), interpolation=cv2.INTER_AREA).astype(np.float32)
    soft = cv2.GaussianBlur(half, (0, 0), 0.008 * width)
    soft = cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR)
    across = np.minimum(1.0, np.minimum(np.arange(width), np.arange(width)[::-1]) / (0.08 * width))
    down = np.minimum(1.0, np.minimum(np.arange(height), np.arange(height)[::-1]) / (0.08 * height))
    soft *= np.outer(down, across).astype(np.float32)  # no edge where the picture ends
    image *= (1.0 - 0.30 * soft)[..., None]


@njit(cache=True)
def _draw(
    screen: FloatArray,
    normals: FloatArray,
    colors: FloatArray,
    faces: IntArray,
    edges: BoolArray,
    lights: FloatArray,
    line_px: float,
    ambient: float,
    color: Pixels,
    depth: Pixels,
) -> None:
    """Rasterise shaded triangles into ``color`` and ``depth`` (larger is nearer)."""
    height, width = depth.shape
    bary = np.empty(3)
    reach = np.empty(3)
    for f in range(len(faces)):
        a, b, c = faces[f]
        xa, ya = screen[a, 0], screen[a, 1]
        xb, yb = screen[b, 0], screen[b, 1]
        xc, yc = screen[c, 0], screen[c, 1]
        area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
        if abs(area) < 1e-12:
            continue
        # Height of each corner over its opposite edge, in pixels: turns a barycentric into a distance.
        reach[0] = abs(area) / max(np.hypot(xc - xb, yc - yb), 1e-9)
        reach[1] = abs(area) / max(np.hypot(xa - xc, ya - yc), 1e-9)
        reach[2] = abs(area) / max(np.hypot(xb - xa, yb - ya), 1e-9)
        left = max(int(np.floor(min(xa, xb, xc) - 0.5)), 0)
        right = min(int(np.ceil(max(xa, xb, xc) - 0.5)), width - 1)
        top = max(int(np.floor(min(ya, yb, yc) - 0.5)), 0)
        bottom = min(int(np.ceil(max(ya, yb, yc) - 0.5)), height - 1)
        for row in range(top, bottom + 1):
            y = row + 0.5
            for column in range(left, right + 1):
                x = column + 0.5
                bary[0] = ((xb - x) * (yc - y) - (xc - x) * (yb - y)) / area
                bary[1] = ((xc - x) * (ya - y) - (xa - x) * (yc - y)) / area
                bary[2] = 1.0 - bary[0] - bary[1]
                if bary[0] < 0.0 or bary[1] < 0.0 or bary[2] < 0.0:
                    continue
                near = bary[0] * screen[a, 2] + bary[1] * screen[b, 2] + bary[2] * screen[c, 2]
                if near <= depth[row, column]:
                    continue
                depth[row, column] = near
                nx = bary[0] * normals[a, 0] + bary[1] * normals[b, 0] + bary[2] * normals[c, 0]
                ny = bary[0] * normals[a, 1] + bary[1] * normals[b, 1] + bary[2] * normals[c, 1]
                nz = bary[0] * normals[a, 2] + bary[1] * normals[b, 2] + bary[2] * normals[c, 2]
                length = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
                nx, ny, nz = nx / length, ny / length, nz / length
                head = nx * lights[0, 0] + ny * lights[0, 1] + nz * lights[0, 2]
                key = nx * lights[1, 0] + ny * lights[1, 1] + nz * lights[1, 2]
                hx = lights[0, 0] + lights[1, 0]
                hy = lights[0, 1] + lights[1, 1]
                hz = lights[0, 2] + lights[1, 2]
                half = (nx * hx + ny * hy + nz * hz) / np.sqrt(hx * hx + hy * hy + hz * hz)
                shade = 0.42 + 0.10 * nz + 0.18 * max(head, 0.0) + 0.42 * max(key, 0.0)
                shade = ambient + (1.0 - ambient) * shade
                shine = 0.16 * max(half, 0.0) ** 40
                line = 0.0
                for k in range(3):
                    if edges[f, k]:
                        line = max(line, min(max(line_px + 0.5 - bary[k] * reach[k], 0.0), 1.0))
                shade *= 1.0 - 0.30 * line
                for k in range(3):
                    base = bary[0] * colors[a, k] + bary[1] * colors[b, k] + bary[2] * colors[c, k]
                    color[row, column, k] = min(base * shade + shine, 1.0)


@njit(cache=True)
def _fill(screen: IntArray, faces: IntArray, mask: ImageArray) -> None:
    """Set every pixel of ``mask`` that a triangle covers."""
    height, width = mask.shape
    for f in range(len(faces)):
        a, b, c = faces[f]
        xa, ya, xb, yb, xc, yc = (
            screen[a, 0], screen[a, 1], screen[b, 0], screen[b, 1], screen[c, 0], screen[c, 1],
        )  # fmt: skip
        for row in range(max(min(ya, yb, yc), 0), min(max(ya, yb, yc), height - 1) + 1):
            for column in range(max(min(xa, xb, xc), 0), min(max(xa, xb, xc), width - 1) + 1):
                s = (xb - xa) * (row - ya) - (yb - ya) * (column - xa)
                t = (xc - xb) * (row - yb) - (yc - yb) * (column - xb)
                u = (xa - xc) * (row - yc) - (ya - yc) * (column - xc)
                if (s >= 0 and t >= 0 and u >= 0) or (s <= 0 and t <= 0 and u <= 0):
                    mask[row, column] = 1


@njit(cache=True)
def _compose(
    image: Pixels,
    body_color: Pixels,
    body_depth: Pixels,
    mark_color: Pixels,
    mark_depth: Pixels,
    ghost: float,
) -> None:
    """Lay bodies over the background and marks over both, fainter where they are hidden."""
    height, width = body_depth.shape
    for row in range(height):
        for column in range(width):
            if body_depth[row, column] > 0.0:
                image[row, column] = body_color[row, column]
            if mark_depth[row, column] > 0.0:
                seen = mark_depth[row, column] >= body_depth[row, column]
                share = np.float32(1.0 if seen else ghost)
                image[row, column] += share * (mark_color[row, column] - image[row, column])
