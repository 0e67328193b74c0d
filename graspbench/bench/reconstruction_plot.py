"""The picture of the reconstruction's benchmark."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspbench.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#1f6fb4", "#12395c", "#8a6d1a", "#c98a1b", "#b3202a", "#7a7f87")
_MARKERS = "osD^vX"
_STAGES = (("total_ms", "silhouettes to rest"), ("elastic_ms", "elastic part"), ("preshape_ms", "preshape"))

Rows = Sequence[dict[str, Any]]


def draw_reconstruction_bench(rows: Rows, cost: Rows, output_dir: Path) -> Path:
    """Draw error against time for every method, and the cost over nodes and over images.

    Args:
        rows: One a method and object.
        cost: One a number of nodes or images.
        output_dir: Where ``reconstruction.png`` goes; made if need be.
    """
    figure = style.canvas(1500, 470)
    panels = figure.subplots(1, 3)
    _draw_methods(panels[0], rows)
    _draw_cost(panels[1], [row for row in cost if row["over"] == "nodes"], "nodes", "nodes $n_s$")
    _draw_cost(panels[2], [row for row in cost if row["over"] == "images"], "images", "images")
    figure.tight_layout()
    output_dir.mkdir(parents=True, exist_ok=True)
    path = output_dir / "reconstruction.png"
    partial = output_dir / f".reconstruction.{os.getpid()}.png"
    os.replace(style.save(figure, partial), path)
    return path


def _draw_methods(panel: "Axes", rows: Rows) -> None:
    timed = [row for row in rows if row["time_ms"] is not None]
    for method, colour, marker in zip(
        dict.fromkeys(row["method"] for row in timed), _COLOURS, _MARKERS, strict=False
    ):
        chosen = [row for row in timed if row["method"] == method]
        panel.plot(
            [row["time_ms"] for row in chosen],
            [row["hull_mean_mm"] for row in chosen],
            ls="",
            marker=marker,
            color=colour,
            label=method,
        )
    panel.set(xscale="log", yscale="log", xlabel="time, ms", ylabel="mean distance to the visual hull, mm")
    panel.set_title("One point an object", fontsize=11)
    panel.grid(True, which="major", alpha=0.3)
    panel.legend(fontsize=8)


def _draw_cost(panel: "Axes", rows: Rows, over: str, label: str) -> None:
    for (key, name), colour, marker in zip(_STAGES, _COLOURS, _MARKERS, strict=False):
        x, y = [row[over] for row in rows], [row[key] for row in rows]
        panel.plot(x, y, color=colour, marker=marker, ms=5, label=name)
    panel.set(xlabel=label, ylabel="time, ms", xlim=(0, None), ylim=(0, None))
    panel.set_title(f"Cost over {over}", fontsize=11)
    panel.grid(True, alpha=0.3)
    panel.legend(fontsize=8)
