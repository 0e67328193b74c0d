"""The picture of the planner's benchmark."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.report import style


def draw_planner_bench(
    curves: Mapping[tuple[object, ...], FloatArray], steps: Sequence[Mapping[str, Any]], output_dir: Path
) -> Path:
    """Draw how ratios to the ceiling are distributed, and the best grasp over how far the surface is formed.

    Args:
        curves: Ratios in ascending order, by objects, contacts, model and hand.
        steps: One row a group and share formed.
        output_dir: Where ``planner.png`` goes; made if need be.
    """
    figure = style.canvas(1200, 470)
    left, right = figure.subplots(1, 2)
    groups = list(dict.fromkeys(key[:2] for key in curves))
    for key, ratios in curves.items():
        colour = style.LINES[groups.index(key[:2]) % len(style.LINES)]
        label = f"{key[0]}, {key[1]} contacts" + ("" if key[3] else ", no hand")
        share = np.arange(1, len(ratios) + 1) / len(ratios)
        left.plot(ratios, share, color=colour, ls="-" if key[3] else ":", label=label)
    left.axhline(0.1, color=style.INK, lw=0.6)
    left.set(xlabel="local over ceiling, model 'thesis'", ylabel="share of objects and measures", ylim=(0, 1))
    left.set_xlim(right=1.01)
    for key in dict.fromkeys((row["objects"], row["contacts"], row["quality"]) for row in steps):
        rows = [row for row in steps if (row["objects"], row["contacts"], row["quality"]) == key]
        colour = style.LINES[groups.index(key[:2]) % len(style.LINES)]
        dash = "-" if key[2] == "thesis" else "--"
        label = f"{key[0]}, {key[1]} contacts, {key[2]}"
        right.plot(
            [row["formed"] for row in rows], [row["mean"] for row in rows], color=colour, ls=dash, label=label
        )
    right.set(xlabel="surface formed", ylabel="best grasp so far over the final one, mean", ylim=(0, None))
    for panel in (left, right):
        panel.grid(True, alpha=0.3)
        panel.legend(fontsize=8)
    figure.tight_layout()
    output_dir.mkdir(parents=True, exist_ok=True)
    path = output_dir / "planner.png"
    partial = output_dir / f".planner.{os.getpid()}.png"
    os.replace(style.save(figure, partial), path)
    return path
