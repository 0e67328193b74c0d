"""The stations of the camera and its way between them (thesis figure 3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.report import style
from graspbench.report.render import Viewpoint, render
from graspbench.report.solids import Solid, ball, merge, surface_solid, tube

if TYPE_CHECKING:
    from graspbench.perception.camera import View
    from graspbench.reconstruction.surface import Surface

_SIZE = (1000, 760)
_FIRST, _WAY = style.CONTACT, style.APPROACH
_CAMERA = (0.10, 0.10, 0.10)
_ELEVATION_DEG = 24.0
_LABEL_PX = 42
_LABEL_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.0}
_DEPTH = 0.10
"""Depth of the drawn field of view, as a share of the largest distance of a station."""


def draw_stations(views: Sequence[View], surface: Surface, path: Path, title: str | None = None) -> Path:
    """Draw the stations in the order in which images are taken, the way between them, and the object.

    The way is straight from station to station; what the arm does in between is not known here.

    Args:
        views: The views in the order in which they were taken.
        surface: The reconstructed object.
        path: PNG file to write.
        title: Line over the picture.
    """
    eyes = np.array([view.camera.position for view in views])
    every = np.concatenate([eyes, surface.points])
    target = 0.5 * (every.min(axis=0) + every.max(axis=0))
    radius = float(np.linalg.norm(every - target, axis=1).max())
    view = Viewpoint(target, _azimuth_deg(eyes), _ELEVATION_DEG, 1.04 * radius)
    marks = [ball(eye, 0.016 * radius, _FIRST if k == 0 else _CAMERA) for k, eye in enumerate(eyes)]
    marks += [_field_of_view(each, surface.centroid, radius) for each in views]
    if len(eyes) > 1:
        marks.append(tube(eyes, 0.005 * radius, _WAY))
    head = style.head(44)
    figure = style.canvas(_SIZE[0], head + _SIZE[1] + 40)
    ground = min(0.0, float(surface.points[:, 2].min()))
    image = render([surface_solid(surface, style.SURFACE)], marks, view, _SIZE, ground_height_m=ground)
    style.place(figure, image, 0, head, _SIZE)
    flat = view.project(eyes, *_SIZE)[:, :2]
    away = flat - flat.mean(axis=0)
    places = flat + _LABEL_PX * away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1.0)
    for k, (u, v) in enumerate(places):
        text = f"{k + 1} {views[k].station}"
        style.write(figure, text, float(u), head + float(v) - 7, 10, ha="center", bbox=_LABEL_BOX)
    style.scale_bar(figure, view.pixels_per_m(*_SIZE), _SIZE[0] - 16, head + _SIZE[1] - 8)
    style.title(figure, title)
    entries = [
        style.dot(_FIRST, "first station"),
        style.dot(_CAMERA, "stations, with their fields of view"),
        style.stroke(_WAY, "the camera's way"),
    ]
    figure.legend(handles=entries, loc="lower center", frameon=False, fontsize=12, ncols=len(entries))
    return style.save(figure, path)


def _field_of_view(view: View, towards: FloatArray, radius: float) -> Solid:
    """Return the edges of a station's field of view, cut off near the camera."""
    camera, k = view.camera, view.camera.intrinsics
    depth = _DEPTH * float(np.linalg.norm(camera.position - towards))
    u, v = np.array([0.0, k.width, k.width, 0.0]), np.array([0.0, 0.0, k.height, k.height])
    rays = np.column_stack([(u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(4)])
    pose = camera.transform_camera_to_world
    corners = depth * rays @ pose[:3, :3].T + pose[:3, 3]
    edges = [np.array([camera.position, corner]) for corner in corners]
    edges += [np.array([corners[i], corners[(i + 1) % 4]]) for i in range(4)]
    return merge([tube(edge, 0.003 * radius, _CAMERA) for edge in edges])


def _azimuth_deg(eyes: FloatArray) -> float:
    """Return where to look from so that the stations' projections lie as far apart as can be."""
    best, widest = 0.0, -1.0
    for azimuth in np.arange(0.0, 360.0, 5.0):
        seen = Viewpoint(eyes.mean(axis=0), float(azimuth), _ELEVATION_DEG, 1.0)
        flat = (eyes - seen.target) @ seen.axes[:2].T
        gaps = np.linalg.norm(flat[:, None] - flat[None], axis=-1) + np.diag(np.full(len(eyes), np.inf))
        if len(eyes) > 1 and gaps.min() > widest + 1e-9:
            best, widest = float(azimuth), float(gaps.min())
    return best
