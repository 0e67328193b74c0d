"""What foretells that a grasp withstands, drawn with intervals."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from graspbench.report.style import save

_SCORES = (("spearman", "Spearman's rank correlation", 0.0), ("auc", "area under the ROC curve", 0.5))


def draw_study(rows: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw each predictor's rank correlation and area under the curve with their intervals.

    Args:
        rows: One a predictor, best first.
        path: The picture.
    """
    names = [str(row["predictor"]).replace("_", " ") for row in rows]
    places = np.arange(len(rows))[::-1]
    figure = Figure(figsize=(7.0, 0.22 * len(rows) + 0.9), layout="constrained")
    axes = figure.subplots(1, len(_SCORES), sharey=True)
    for axis, (key, label, chance) in zip(axes, _SCORES, strict=True):
        values = np.array([row[key] for row in rows], dtype=float)
        ends = np.array([[row[f"{key}.low"], row[f"{key}.high"]] for row in rows], dtype=float)
        away = np.abs(ends - values[:, None]).T
        axis.errorbar(values, places, xerr=away, fmt="o", markersize=3.5, capsize=2.0, linewidth=1.0)
        axis.axvline(chance, linewidth=0.8, linestyle=":", color="0.4")
        axis.set_xlabel(label)
    axes[0].set_yticks(places, names)
    return save(figure, path)
