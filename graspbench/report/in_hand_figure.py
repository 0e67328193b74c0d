"""Picture of an in-hand motion played in physics: how far the real object is from where it should be."""

from pathlib import Path
from typing import TYPE_CHECKING

from graspbench.report.style import INK, canvas, save

if TYPE_CHECKING:
    from graspbench.simulation.in_hand import InHandResult


def draw_in_hand(result: "InHandResult", path: Path, *, title: str) -> Path:
    """Draw the object's motion in the hand and its pose error over time.

    Args:
        result: What was played; it came to the motion.
        path: The picture.
        title: Its title.
    """
    figure = canvas(900, 650)
    upper, lower = figure.subplots(2, 1, sharex=True)
    far = 1e3 * result.moved_m, 1e3 * result.position_error_m
    turned = result.turned_deg, result.rotation_error_deg
    for axis, (moved, error), unit, what in (
        (upper, far, "mm", "position"),
        (lower, turned, "deg", "orientation"),
    ):
        axis.plot(result.times, moved, color="0.55", lw=4, alpha=0.6, label="from the start")
        axis.plot(result.times, error, color=INK, lw=2, label="from where it should be")
        axis.set_ylabel(f"{what} ({unit})")
        axis.set_ylim(bottom=0.0)
        axis.margins(x=0.0)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False)
    upper.set_title(title, loc="left", color=INK)
    lower.set_xlabel("time (s)")
    return save(figure, path)
