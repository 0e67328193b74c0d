"""The inner loops of the software renderer: triangles with a depth buffer."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from graspbench.arrays import BoolArray, FloatArray, ImageArray, IntArray
from graspbench.compiled import compiled

Pixels: TypeAlias = npt.NDArray[np.float32]


@compiled
def draw_triangles(
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


@compiled
def fill_triangles(screen: npt.NDArray[np.int32], faces: IntArray, mask: ImageArray) -> None:
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


@compiled
def lay_over(
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
