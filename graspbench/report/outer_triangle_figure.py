"""Figures A.1 and A.2: a Mirtich-Canny grasp, how the fingers got there, and its outer triangle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from graspbench.arrays import FloatArray
from graspbench.report import style
from graspbench.report.figures import draw_grasp_image, grasp_legend

if TYPE_CHECKING:
    from graspbench.grasp.configuration import Grasp
    from graspbench.planning.trajectory import FingertipPath
    from graspbench.reconstruction.surface import Surface

_SIZE = (760, 640)
_SIDE, _HEAD, _FOOT = 620, 70, 46
_TRIANGLE = (0.0, 0.35, 0.65)
_SECTION = (0.45, 0.48, 0.52)


def draw_outer_triangle(
    surface: Surface, grasp: Grasp, paths: Sequence[FingertipPath], path: Path, title: str, caption: str
) -> Path:
    """Draw the fingertips' paths on the surface, and the outer triangle in the grip plane.

    Args:
        surface: The surface at rest.
        grasp: Three contacts on it, whose normals surround a point of the grip plane.
        paths: The fingertip paths.
        path: PNG file to write.
        title: First line.
        caption: Second line.
    """
    head = style.head(_HEAD)
    width, height = _SIZE[0] + _SIDE, head + _SIZE[1] + _FOOT
    figure = style.canvas(width, height)
    draw_grasp_image(figure, (0, head), _SIZE, surface, grasp, paths)
    style.title(figure, title, caption)
    entries = grasp_legend(bool(paths))
    figure.legend(
        handles=entries, loc="lower left", bbox_to_anchor=(0.01, 2 / height), frameon=False, fontsize=12,
        ncols=len(entries), columnspacing=1.6, handlelength=1.4,
    )  # fmt: skip
    axes = figure.add_axes(
        ((_SIZE[0] + 70) / width, (_FOOT + 50) / height, (_SIDE - 100) / width, (_SIZE[1] - 110) / height)
    )
    _draw_grip_plane(axes, surface, grasp)
    return style.save(figure, path)


def outer_triangle_corners(points: FloatArray, normals: FloatArray) -> FloatArray:
    """Return the corners of the outer triangle; corner i lies between the lines of contacts i and i + 1.

    Args:
        points: Contacts in the grip plane, shape (3, 2).
        normals: Unit normals in it, shape (3, 2), no two parallel.
    """
    heights = (points * normals).sum(axis=1)
    pairs = [(i, (i + 1) % 3) for i in range(3)]
    return np.array([np.linalg.solve(normals[[i, j]], heights[[i, j]]) for i, j in pairs])


def _draw_grip_plane(axes: Axes, surface: Surface, grasp: Grasp) -> None:
    """Draw section, contacts, normals and outer triangle in the grip plane, mm."""
    to_plane, normal = _plane_frame(grasp.points)
    middle = grasp.points.mean(axis=0)
    points = 1e3 * (grasp.points - middle) @ to_plane.T
    normals = grasp.normals @ to_plane.T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for segment in 1e3 * (_section(surface, middle, normal) - middle) @ to_plane.T:
        axes.plot(*segment.T, color=_SECTION, lw=1.6, solid_capstyle="round")
    corners = outer_triangle_corners(points, normals)
    axes.fill(*corners.T, facecolor=(*_TRIANGLE, 0.10), edgecolor=_TRIANGLE, lw=1.8, ls="--")
    reach = 0.16 * np.ptp(corners, axis=0).max()
    axes.update_datalim(points + 1.05 * reach * normals)
    for point, direction in zip(points, normals, strict=True):
        axes.annotate(
            "", xytext=point + reach * direction, xy=point,
            arrowprops={"arrowstyle": "-|>", "color": style.APPROACH, "lw": 2.0, "shrinkA": 0, "shrinkB": 3},
        )  # fmt: skip
    axes.plot(*points.T, ls="", marker="o", ms=9, color=style.CONTACT)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.set_xlabel("in the grip plane, mm", fontsize=11, color=style.INK)
    axes.set_ylabel("in the grip plane, mm", fontsize=11, color=style.INK)
    axes.set_title("Grip plane: section, finger forces (green), outer triangle (dashed)", fontsize=11)
    axes.grid(color="0.92")
    axes.set_axisbelow(True)


def _plane_frame(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two rows that span the plane of three points, the second upright, and its normal."""
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    normal /= np.linalg.norm(normal)
    if normal[2] < 0.0:
        normal = -normal
    up = np.eye(3)[2 if abs(normal[2]) < 0.7 else 1]
    second = up - (up @ normal) * normal
    second /= np.linalg.norm(second)
    return np.stack((np.cross(second, normal), second)), normal


def _section(surface: Surface, point: FloatArray, normal: FloatArray) -> FloatArray:
    """Return where a plane cuts the surface's triangles, shape (n, 2, 3)."""
    faces = surface.network.faces
    heights = ((surface.points - point) @ normal)[faces]
    cut = (heights > 0).any(axis=1) & (heights <= 0).any(axis=1)
    segments = []
    for face, height in zip(faces[cut], heights[cut], strict=True):
        ends = []
        for a, b in ((0, 1), (1, 2), (2, 0)):
            if (height[a] > 0) != (height[b] > 0):
                share = height[a] / (height[a] - height[b])
                ends.append((1 - share) * surface.points[face[a]] + share * surface.points[face[b]])
        segments.append(ends)
    return np.array(segments).reshape(-1, 2, 3)
