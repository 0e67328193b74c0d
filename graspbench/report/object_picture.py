"""A picture of an object: its surface, and the convex pieces that stand for it in physics."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.report import style
from graspbench.report.render import Viewpoint, render
from graspbench.report.solids import Rgb, mesh_solid

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

_TILE = 420
# Okabe and Ito's colours, which every eye tells apart, for neighbouring pieces.
_PIECES: tuple[Rgb, ...] = (
    (0.90, 0.62, 0.00), (0.34, 0.71, 0.91), (0.00, 0.62, 0.45), (0.94, 0.89, 0.26), (0.00, 0.45, 0.70),
    (0.84, 0.37, 0.00), (0.80, 0.47, 0.65), (0.60, 0.60, 0.60),
)  # fmt: skip


def draw_object(model: ObjectModel, path: Path) -> Path:
    """Draw an object from two sides, and its collision pieces each in a colour.

    Args:
        model: The object.
        path: PNG file to write.
    """
    vertices = np.asarray(model.mesh.vertices)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = 0.5 * (low + high)
    radius = 1.05 * float(np.linalg.norm(vertices - middle, axis=1).max())
    whole = [mesh_solid(vertices, np.asarray(model.mesh.faces), style.SURFACE)]
    pieces = [
        mesh_solid(np.asarray(part.vertices), np.asarray(part.faces), _PIECES[k % len(_PIECES)])
        for k, part in enumerate(model.collision_parts)
    ]
    count = len(pieces)
    tiles = (
        (whole, -60.0, "surface"),
        (whole, 120.0, "surface from behind"),
        (pieces, -60.0, f"{count} convex piece{'s' * (count != 1)} for physics"),
    )
    head = style.head(44)
    figure = style.canvas(_TILE * len(tiles), _TILE + head + 30)
    for k, (solids, azimuth_deg, label) in enumerate(tiles):
        view = Viewpoint(middle, azimuth_deg, 20.0, radius)
        image = render(solids, [], view, (_TILE, _TILE), ground_height_m=float(low[2]))
        style.place(figure, image, k * _TILE, head, (_TILE, _TILE))
        style.write(figure, label, (k + 0.5) * _TILE, _TILE + head + 2, 12, ha="center")
    size = " x ".join(f"{1e3 * length:.0f}" for length in high - low)
    style.title(figure, f"{model.name}, {size} mm, {1e3 * model.mass_kg:.0f} g")
    scale = Viewpoint(middle, 0.0, 20.0, radius).pixels_per_m(_TILE, _TILE)
    style.scale_bar(figure, scale, _TILE - 16, head + _TILE - 8)
    return style.save(figure, path)
