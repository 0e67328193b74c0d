"""Pictures of a trial: its views, its surface as it forms, its grasp."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from graspbench.arrays import FloatArray, ImageArray
from graspbench.reconstruction.carrying import mean_distance
from graspbench.report import style
from graspbench.report.render import Viewpoint, render, visibility
from graspbench.report.solids import Solid, ball, surface_solid, tube

if TYPE_CHECKING:  # pictures only read attributes: no need to load the stages
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from graspbench.grasp.configuration import Grasp
    from graspbench.perception.camera import View
    from graspbench.perception.silhouette import Silhouette
    from graspbench.planning.trajectory import FingertipPath
    from graspbench.reconstruction.surface import Surface

_TILE = (300, 225)
_GAP = 6
_MAX_SEEN = 3.0  # all of the body, which counts twice, and all contacts


def draw_views(views: Sequence[View], silhouettes: Sequence[Silhouette], path: Path) -> Path:
    """Draw every view with its silhouette's outline and bounding box (thesis figure 3.3).

    All tiles have the same zoom, around the object.

    Args:
        views: The views.
        silhouettes: Their silhouettes, in any order; a view may lack its own.
        path: PNG file to write.
    """
    found = {silhouette.station: silhouette for silhouette in silhouettes}
    columns = min(5, len(views))
    rows = -(-(len(views) + 1) // columns)  # one tile is left for the legend
    width = columns * (_TILE[0] + _GAP) + _GAP
    height = rows * (_TILE[1] + _GAP) + _GAP
    figure = style.canvas(width, height)
    zoom = _zoom(views, silhouettes)
    for k, view in enumerate(views):
        left = _GAP + (k % columns) * (_TILE[0] + _GAP)
        top = _GAP + (k // columns) * (_TILE[1] + _GAP)
        style.place(figure, _tile(view, found.get(view.station), zoom), left, top, _TILE)
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 2.5}
        style.write(figure, view.station, left + 8, top + 8, 10, bbox=box)
    entries = [style.stroke(style.OUTLINE, "silhouette", 2.5), style.stroke(style.BOX, "bounding box", 2.5)]
    place = (1.0 - _GAP / width, (_GAP + 0.5 * _TILE[1]) / height)
    figure.legend(handles=entries, loc="center right", bbox_to_anchor=place, frameon=False, fontsize=12)
    return style.save(figure, path)


def draw_surface_moments(surfaces: Sequence[Surface], path: Path, title: str | None = None) -> Path:
    """Draw the reconstruction surface at several moments, to one scale (thesis figure 3.10).

    Args:
        surfaces: The moments, at best four (`pick_moments` chooses).
        path: PNG file to write.
        title: Line over the picture.
    """
    size, head = 400, style.head(44)
    points = np.concatenate([surface.points for surface in surfaces])
    ground = float(surfaces[-1].points[:, 2].min())
    view = _broadest_viewpoint(surfaces[-1].points, points)
    figure = style.canvas(size * len(surfaces), size + head + 34)
    for k, surface in enumerate(surfaces):
        solid = surface_solid(surface, style.SURFACE)
        image = render([solid], [], view, (size, size), ground_height_m=ground if surface.at_rest else None)
        style.place(figure, image, k * size, head, (size, size))
        label = "at rest" if surface.at_rest else "first ellipsoid" if surface.iteration == 0 else ""
        text = ", ".join(filter(None, (f"step {surface.iteration}", label)))
        style.write(figure, text, (k + 0.5) * size, size + head + 4, 12, ha="center")
    style.scale_bar(figure, view.pixels_per_m(size, size), size * len(surfaces) - 16, head + size - 8)
    style.title(figure, title)
    return style.save(figure, path)


def pick_moments(surfaces: Sequence[Surface], count: int = 4) -> tuple[Surface, ...]:
    """Choose snapshots that show the surface's way: the first, the last, and between them by distance."""
    if len(surfaces) <= count:
        return tuple(surfaces)
    last = surfaces[-1]
    left = np.array([mean_distance(surface, last) for surface in surfaces])
    wanted = left[0] * np.linspace(1.0, 0.0, count)
    chosen = [0, *(int(np.argmin(np.abs(left[1:-1] - w))) + 1 for w in wanted[1:-1]), len(surfaces) - 1]
    return tuple(surfaces[k] for k in sorted(set(chosen)))


def draw_grasp(
    surface: Surface,
    grasp: Grasp,
    paths: Sequence[FingertipPath],
    path: Path,
    *,
    hand: Sequence[Solid] = (),
    title: str | None = None,
    caption: str | None = None,
) -> Path:
    """Draw the final grasp and how the fingertips got there (thesis figure 3.11).

    Args:
        surface: The surface at rest.
        grasp: The grasp on it.
        paths: The fingertip paths; may be empty.
        path: PNG file to write.
        hand: The hand's links in the world, if it shall be seen.
        title: First line of the picture.
        caption: Second line, such as the scores.
    """
    size, head, foot = (1100, 760), style.head(64 if caption else 40), 40
    figure = style.canvas(size[0], head + size[1] + foot)
    draw_grasp_image(figure, (0, head), size, surface, grasp, paths, hand=hand)
    style.title(figure, title, caption)
    entries = grasp_legend(bool(paths))
    place = (0.5, 4 / (head + size[1] + foot))
    figure.legend(
        handles=entries, loc="lower center", bbox_to_anchor=place, frameon=False, fontsize=12,
        ncols=len(entries), columnspacing=2.0, handlelength=1.4,
    )  # fmt: skip
    return style.save(figure, path)


def draw_grasp_image(
    figure: Figure,
    corner: tuple[int, int],
    size: tuple[int, int],
    surface: Surface,
    grasp: Grasp,
    paths: Sequence[FingertipPath],
    *,
    hand: Sequence[Solid] = (),
    more: Sequence[Solid] = (),
) -> None:
    """Draw a grasp and its fingertip paths from where object and contacts are seen best, with a scale bar.

    Args:
        figure: Where to.
        corner: Its left and upper edge, pixels of the layout.
        size: Width and height, pixels of the layout.
        surface: The surface at rest.
        grasp: The grasp on it.
        paths: The fingertip paths; may be empty.
        hand: The hand's links in the world.
        more: Further marks that shine through.
    """
    seen = [surface.points, *(p.approach for p in paths), *(s.points for s in (*hand, *more))]
    view = _best_viewpoint(np.concatenate(seen), grasp, size[0] / size[1], surface, hand)
    scale = view.radius_m
    marks = [ball(point, 0.024 * scale, style.CONTACT) for point in grasp.points]
    marks.append(ball(grasp.centroid, 0.028 * scale, style.CENTROID))
    for finger in paths:
        marks += [ball(point, 0.011 * scale, style.VIA) for point in finger.via]
        marks.append(tube(finger.approach, 0.006 * scale, style.APPROACH))
        marks.append(tube(finger.grasp, 0.008 * scale, style.GRASP))
    ground = float(surface.points[:, 2].min())
    solids = [surface_solid(surface, style.SURFACE), *hand]
    image = render(solids, [*marks, *more], view, size, ground_height_m=ground)
    style.place(figure, image, *corner, size)
    right, bottom = corner[0] + size[0] - 20, corner[1] + size[1] - 12
    style.scale_bar(figure, view.pixels_per_m(*size), right, bottom)


def grasp_legend(with_paths: bool) -> list[Line2D]:
    """Return the legend's entries of a grasp's picture."""
    entries = [style.dot(style.CONTACT, "contacts"), style.dot(style.CENTROID, "centroid")]
    if with_paths:
        entries += [
            style.dot(style.VIA, "via points", 7),
            style.stroke(style.APPROACH, "approach"),
            style.stroke(style.GRASP, "grasp"),
        ]
    return entries


def _viewpoint(
    points: FloatArray, azimuth_deg: float, elevation_deg: float, aspect: float = 1.0
) -> Viewpoint:
    """Return the view from a direction in which the points fill a picture of some width to height."""
    axes = Viewpoint(np.zeros(3), azimuth_deg, elevation_deg, 1.0).axes
    local = points @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    half = 0.5 * (high - low)
    wide, tall = half[0] / max(aspect, 1.0), half[1] * min(aspect, 1.0)
    # What is nearer than the middle looks larger.
    radius = 1.06 * (max(wide, tall) + 0.2 * half[2])
    return Viewpoint(0.5 * (low + high) @ axes, azimuth_deg, elevation_deg, float(radius))


def travel_viewpoint(points: FloatArray, grasp: Grasp) -> Viewpoint:
    """Return the view of all points in which a grasp's contacts are seen best."""
    return _best_viewpoint(points, grasp, 1.0)


def _broadest_viewpoint(body: FloatArray, points: FloatArray) -> Viewpoint:
    """Return the view of all points, a little from above, in which a body shows the most of itself."""

    def area(view: Viewpoint) -> float:
        flat = ((body - body.mean(axis=0)) @ view.axes[:2].T).astype(np.float32)
        return float(cv2.contourArea(cv2.convexHull(flat)))

    views = [_viewpoint(points, azimuth, 18.0) for azimuth in np.arange(-180.0, 180.0, 15.0)]
    return max(views, key=area)


def _best_viewpoint(
    points: FloatArray,
    grasp: Grasp,
    aspect: float,
    surface: Surface | None = None,
    hand: Sequence[Solid] = (),
) -> Viewpoint:
    """Choose the view in which the most of object and contacts is seen, and the contacts farthest apart."""
    body = None if surface is None else surface_solid(surface, style.SURFACE)

    def spread(view: Viewpoint) -> float:
        facing = np.clip(grasp.normals @ view.direction + 0.15, -0.3, 0.4).sum()
        screen = (grasp.points - grasp.centroid) @ view.axes[:2].T
        apart = np.linalg.norm(screen[:, None] - screen[None], axis=-1)
        np.fill_diagonal(apart, np.inf)
        return float(facing + 0.5 * apart.min() / view.radius_m)

    directions = [(a, e) for e in (14.0, 24.0, 36.0) for a in np.arange(-180.0, 180.0, 15.0)]
    views = sorted((_viewpoint(points, a, e, aspect) for a, e in directions), key=spread, reverse=True)
    if body is None or not hand:
        return views[0]
    best, worth = views[0], -np.inf
    for view in views:
        if spread(view) + _MAX_SEEN <= worth:  # to look what is hidden takes most of the time
            break
        shown = visibility(body, hand, grasp.points, view)
        seen = 2.0 * shown.body + float(shown.points.mean())
        if seen + spread(view) > worth:
            best, worth = view, seen + spread(view)
    return best


def _zoom(views: Sequence[View], silhouettes: Sequence[Silhouette]) -> float:
    """Return the common magnification: the largest box fills two thirds of its tile."""
    fits = [_TILE[0] / view.camera.intrinsics.width for view in views]
    room = [
        0.66 * min(_TILE[0] / (s.box[2] - s.box[0]), _TILE[1] / (s.box[3] - s.box[1])) for s in silhouettes
    ]
    return float(max(min(fits), min(room, default=0.0)))


def _tile(view: View, silhouette: Silhouette | None, zoom: float) -> ImageArray:
    """Return one view around its object, with outline and box."""
    height, width = view.image.shape[:2]
    middle = np.array([width, height]) / 2.0
    if silhouette is not None:
        u_min, v_min, u_max, v_max = silhouette.box
        middle = np.array([u_min + u_max, v_min + v_max]) / 2.0
    span = np.array(_TILE) / zoom
    full = np.array([width, height], dtype=float)
    corner = np.where(
        span < full, np.clip(middle - span / 2, 0.0, np.maximum(full - span, 0.0)), (full - span) / 2
    )
    matrix = np.array([[zoom, 0.0, -zoom * corner[0]], [0.0, zoom, -zoom * corner[1]]])
    warp = matrix.copy()
    warp[:, 2] += 0.5 * zoom - 0.5  # pixel centres, not corners
    smooth = cv2.INTER_AREA if zoom < 1 else cv2.INTER_CUBIC
    tile = cv2.warpAffine(view.image, warp, _TILE, flags=smooth, borderValue=(235, 235, 235))
    if silhouette is not None:
        contours, _ = cv2.findContours(
            silhouette.image_mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        lines = [contour[:, 0, :] + 0.5 for contour in contours]
        _polygons(tile, lines, matrix, style.OUTLINE, 2)
        box = np.array([[u_min, v_min], [u_max, v_min], [u_max, v_max], [u_min, v_max]])
        _polygons(tile, [box], matrix, style.BOX, 1)
    drawn: ImageArray = tile.astype(np.uint8)
    return drawn


def _polygons(
    tile: ImageArray,
    polygons: Sequence[FloatArray],
    matrix: FloatArray,
    color: tuple[float, float, float],
    width: int,
) -> None:
    """Draw closed polygons given in image coordinates, to a 16th of a pixel."""
    rgb = tuple(255.0 * c for c in color)
    scaled = [
        np.round((polygon @ matrix[:, :2].T + matrix[:, 2] - 0.5) * 16).astype(np.int32)
        for polygon in polygons
    ]
    cv2.polylines(tile, scaled, True, rgb, width, cv2.LINE_AA, 4)
