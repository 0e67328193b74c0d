"""The pictures of a trial."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from graspbench.perception import Silhouette, View
from graspbench.planning import FingertipPath, LocalPlan
from graspbench.reconstruction import Surface
from graspbench.report import draw_grasp, draw_surface_moments, draw_views, pick_moments


def draw_trial(
    folder: Path,
    title: str,
    local: Mapping[str, Any],
    views: Sequence[View],
    silhouettes: Sequence[Silhouette],
    surfaces: Sequence[Surface],
    plan: LocalPlan,
    paths: Sequence[FingertipPath],
) -> None:
    """Draw ``views.png``, ``surface.png`` and ``grasp.png`` (thesis figures 3.3, 3.10 and 3.11)."""
    draw_views(views, silhouettes, folder / "views.png")
    draw_surface_moments(pick_moments(surfaces), folder / "surface.png")
    caption = "   ".join(f"{measure.upper()} {local[measure]:.3g}" for measure in ("q1", "q2", "q3"))
    draw_grasp(surfaces[-1], plan.grasp, paths, folder / "grasp.png", title=title, caption=caption)
