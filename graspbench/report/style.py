"""Colours and common parts of all pictures (colour-blind safe: light and dark differ too)."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from graspbench.arrays import ImageArray
from graspbench.report.solids import Rgb

SURFACE = (0.62, 0.76, 0.90)
HAND = (0.62, 0.64, 0.68)
CONTACT = (0.80, 0.08, 0.16)
CENTROID = (0.08, 0.08, 0.10)
FLOATING = (0.98, 0.78, 0.08)
APPROACH = (0.13, 0.62, 0.30)
GRASP = (0.80, 0.08, 0.16)
OUTLINE = (0.05, 0.95, 0.45)
BOX = (1.0, 0.72, 0.0)
INK = "#22262b"
DPI = 100


def canvas(width: int, height: int) -> Figure:
    """Return an empty white figure of a size in pixels, free of any global state."""
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def place(figure: Figure, image: ImageArray, left: int, top: int) -> None:
    """Put an image on a figure, pixel by pixel, its corner at (left, top) from the upper left."""
    height = round(figure.get_figheight() * DPI)
    flipped = np.ascontiguousarray(image[::-1])
    figure.figimage(flipped, left, height - top - len(image), origin="lower")


def write(figure: Figure, text: str, left: float, top: float, size: float = 11, **options: object) -> None:
    """Write text on a figure at pixels from the upper left."""
    width, height = figure.get_figwidth() * DPI, figure.get_figheight() * DPI
    settings: dict[str, object] = {"ha": "left", "va": "top", "color": INK, "fontsize": size} | options
    figure.text(left / width, 1.0 - top / height, text, **settings)  # type: ignore[arg-type]


def dot(color: Rgb, label: str, size: float = 9) -> Line2D:
    """Return a legend entry for points."""
    return Line2D([], [], ls="", marker="o", ms=size, mec="none", color=color, label=label)


def stroke(color: Rgb, label: str, width: float = 3.5) -> Line2D:
    """Return a legend entry for lines."""
    return Line2D([], [], color=color, lw=width, solid_capstyle="round", label=label)


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG; the file holds no date, so equal pictures are equal files."""
    figure.savefig(path, dpi=DPI, metadata={"Software": None}, pil_kwargs={"compress_level": 4})
    return path
