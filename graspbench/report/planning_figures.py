"""Pictures of a local plan: contacts on the shrinking surface, the force field and the barrier there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from graspbench.arrays import FloatArray, IntArray
from graspbench.reconstruction.carrying import carry_over
from graspbench.report import style
from graspbench.report.figures import draw_grasp_image, pick_moments, travel_viewpoint
from graspbench.report.render import render
from graspbench.report.solids import Solid, ball, surface_solid, tube

if TYPE_CHECKING:
    from graspbench.grasp.configuration import Grasp
    from graspbench.planning.barrier import BarrierValues
    from graspbench.planning.indices.force_field import FieldForces
    from graspbench.reconstruction.surface import Surface

_TILE = 400
_TERMS = {
    "plane": (0.00, 0.45, 0.70),
    "centroid": (0.90, 0.62, 0.00),
    "equilateral": (0.00, 0.62, 0.45),
    "area": (0.80, 0.47, 0.65),
    "barrier": (0.10, 0.10, 0.10),
}
_PROJECTED = (0.84, 0.37, 0.00)


def draw_travel(surfaces: Sequence[Surface], history: Sequence[Grasp], path: Path, title: str) -> Path:
    """Draw the contacts on the shrinking surface at four moments (thesis figure 3.10).

    Between two configurations the contacts stay on their nodes, which the surface carries inwards.

    Args:
        surfaces: All snapshots, first to last.
        history: The plan's configurations on them.
        path: PNG file to write.
        title: Line over the picture.
    """
    moments = pick_moments(surfaces)
    order = {id(surface): k for k, surface in enumerate(surfaces)}
    when = [_snapshot_of(grasp, surfaces) for grasp in history]
    view = travel_viewpoint(surfaces[0].points, history[-1])
    head = style.head(44)
    figure = style.canvas(_TILE * len(moments), head + _TILE + 72)
    for k, surface in enumerate(moments):
        done = [grasp for grasp, at in zip(history, when, strict=True) if at <= order[id(surface)]]
        marks = [
            ball(point, 0.012 * view.radius_m, style.VIA) for grasp in done[:-1] for point in grasp.points
        ]
        contacts = carry_over(done[-1].vertices, surfaces[when[len(done) - 1]], surface)
        marks += [ball(point, 0.035 * view.radius_m, style.CONTACT) for point in surface.points[contacts]]
        image = render([surface_solid(surface, style.SURFACE)], marks, view, (_TILE, _TILE))
        style.place(figure, image, k * _TILE, head, (_TILE, _TILE))
        moves = len(done) - 1
        text = f"step {surface.iteration}, configuration {moves + 1} of {len(history)}"
        style.write(figure, text, (k + 0.5) * _TILE, head + _TILE + 6, 12, ha="center")
    style.scale_bar(figure, view.pixels_per_m(_TILE, _TILE), _TILE - 16, head + _TILE - 8)
    style.title(figure, title)
    entries = [style.dot(style.CONTACT, "contacts"), style.dot(style.VIA, "earlier contacts", 7)]
    figure.legend(handles=entries, loc="lower center", frameon=False, fontsize=12, ncols=2)
    return style.save(figure, path)


def draw_forces(
    surface: Surface, grasp: Grasp, forces: FieldForces, barrier: BarrierValues, path: Path, title: str
) -> Path:
    """Draw the force field's terms at the contacts and the barrier at the contour points around them.

    Args:
        surface: The surface at rest.
        grasp: The contacts.
        forces: The field there, term by term.
        barrier: The barrier at contacts and contour points.
        path: PNG file to write.
        title: Line over the picture.
    """
    n_f, size, panel, head, foot = len(grasp.points), (560, 470), 300, style.head(78, 44), 50
    width, height = size[0] + n_f * panel + 90, head + size[1] + foot
    figure = style.canvas(width, height)
    terms = {name: np.asarray(getattr(forces, name)) for name in _TERMS}
    every = np.concatenate([*terms.values(), forces.projected])
    most = max(float(np.linalg.norm(every, axis=1).max()), 1e-9)
    radius = float(np.linalg.norm(surface.points - surface.centroid, axis=1).mean())
    arrows = [
        _pointer(point, 0.6 * radius / most * force, 0.016 * radius, color)
        for (name, color) in _TERMS.items()
        for point, force in zip(grasp.points, terms[name], strict=True)
        if np.linalg.norm(force) > 0.01 * most
    ]
    draw_grasp_image(figure, (0, head), size, surface, grasp, (), more=arrows)
    style.title(figure, title)
    note = (
        f"longest arrow {most:.2g} N; right: tangent planes, points coloured by the barrier, x out of reach"
    )
    style.write(figure, note, 18, head - 34, 12)
    largest = max(float(barrier.total[barrier.reachable].max(initial=0.0)), 1e-3)
    scale = Normalize(0.0, largest)
    for i in range(n_f):
        left = size[0] + 62 + i * panel
        axes = figure.add_axes((left / width, (foot + 60) / height, 228 / width, (size[1] - 90) / height))
        _draw_tangent_plane(axes, surface, grasp, terms, forces.projected, barrier, i, scale, most)
        if i == 0:
            axes.set_ylabel("mm", fontsize=11)
    bar = figure.add_axes(((width - 62) / width, (foot + 60) / height, 12 / width, (size[1] - 90) / height))
    mapped = bar.imshow(
        np.linspace(1, 0, 64)[:, None], aspect="auto", cmap="viridis", extent=(0.0, 1.0, 0.0, largest)
    )
    mapped.set_clim(0, 1)
    bar.set_xticks([])
    bar.yaxis.tick_right()
    bar.tick_params(labelsize=9)
    bar.set_title("N", fontsize=10)
    entries = [style.stroke(color, f"f {name}") for name, color in _TERMS.items()]
    entries.append(style.stroke(_PROJECTED, "f' (sum, tangential)"))
    figure.legend(handles=entries, loc="lower center", frameon=False, fontsize=12, ncols=len(entries))
    return style.save(figure, path)


def _draw_tangent_plane(
    axes: Axes,
    surface: Surface,
    grasp: Grasp,
    terms: dict[str, FloatArray],
    projected: FloatArray,
    barrier: BarrierValues,
    i: int,
    scale: Normalize,
    most: float,
) -> None:
    """Draw one contact's contour and forces in its tangent plane, mm."""
    frame = _tangents(grasp.normals[i])
    nodes = barrier.nodes[i]
    real = nodes >= 0
    flat = 1e3 * (surface.points[nodes[real]] - grasp.points[i]) @ frame.T
    reach = 1.15 * float(np.abs(flat).max())
    values, reachable = barrier.total[i][real], barrier.reachable[i][real]
    axes.scatter(
        flat[reachable, 0],
        flat[reachable, 1],
        c=values[reachable],
        cmap="viridis",
        norm=scale,
        s=80,
        zorder=2,
    )
    axes.scatter(flat[~reachable, 0], flat[~reachable, 1], marker="x", color="0.3", s=60, zorder=2)
    for name, color in (*_TERMS.items(), ("projected", _PROJECTED)):
        force = projected[i] if name == "projected" else terms[name][i]
        along = reach / most * frame @ force
        if np.linalg.norm(along) > 0.02 * reach:
            axes.annotate(
                "", xytext=(0, 0), xy=tuple(along), zorder=4 if name == "projected" else 3,
                arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2.2, "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_title(f"contact {i + 1}", fontsize=11)
    axes.set_xlabel("mm", fontsize=11)
    axes.tick_params(labelsize=9)
    axes.grid(color="0.92")
    axes.set_axisbelow(True)


def _pointer(
    start: FloatArray, vector: FloatArray, radius_m: float, color: tuple[float, float, float]
) -> Solid:
    """Return a rod from a contact along its force."""
    return tube(np.stack((start, start + 0.5 * vector, start + vector)), radius_m, color)


def _tangents(normal: FloatArray) -> FloatArray:
    """Return two rows that span the tangent plane, the second as upright as can be, shape (2, 3)."""
    up = np.eye(3)[2 if abs(normal[2]) < 0.9 else 1]
    second = up - (up @ normal) * normal
    second /= np.linalg.norm(second)
    return np.stack((np.cross(second, normal), second))


def _snapshot_of(grasp: Grasp, surfaces: Sequence[Surface]) -> int:
    """Return on which snapshot a configuration lies."""
    vertices: IntArray = grasp.vertices
    return next(
        k
        for k, surface in enumerate(surfaces)
        if vertices.max() < len(surface.points) and np.array_equal(surface.points[vertices], grasp.points)
    )
