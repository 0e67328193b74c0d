"""Colours and common parts of all pictures, and how they are written.

The colours are told apart by the colour-blind and in grey: what meets in one picture differs in lightness.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from graspbench.arrays import ImageArray
from graspbench.report.solids import Rgb

SURFACE = (0.62, 0.76, 0.90)
HAND = (0.62, 0.64, 0.68)
CONTACT = (0.66, 0.00, 0.12)
CENTROID = (0.05, 0.05, 0.07)
VIA = (0.98, 0.90, 0.25)
APPROACH = (0.00, 0.52, 0.38)
GRASP = (0.66, 0.00, 0.12)
OUTLINE = (0.05, 0.95, 0.45)
BOX = (1.0, 0.72, 0.0)
INK = "#22262b"
LINES = ("#004a80", "#c2410c", "#009e73", "#e69f00")
"""Colours of curves, after Okabe and Ito, with steps of lightness."""

DPI = 100
"""Of a layout: pictures are laid out in pixels of this size."""

_SCALE_BAR_MM = (100, 50, 20, 10, 5, 2, 1)


@dataclass(frozen=True)
class Look:
    """How pictures are made.

    Attributes:
        resolution: Pixels drawn for a pixel of the layout.
        vector: Whether PDF and SVG are written beside PNG.
        titles: Whether titles are part of a picture, rather than left to the caption under it.
    """

    resolution: int = 1
    vector: bool = False
    titles: bool = False


PRINT = Look(resolution=3, vector=True)
"""For paper: 300 dots an inch, PDF and SVG beside PNG, no title."""

SCREEN = Look()
"""For a screen: PNG alone."""

_LOOK: ContextVar[Look] = ContextVar("look", default=SCREEN)


def look() -> Look:
    """Return how pictures are made now."""
    return _LOOK.get()


@contextmanager
def drawn_as(wanted: Look) -> Iterator[None]:
    """Make pictures so within the block."""
    token = _LOOK.set(wanted)
    try:
        yield
    finally:
        _LOOK.reset(token)


def head(height: int, without: int = 12) -> int:
    """Return the height of a picture's head: that of its titles, or a margin where there are none."""
    return height if look().titles else without


def title(figure: Figure, text: str | None, caption: str | None = None) -> None:
    """Write a picture's first lines, where titles are part of pictures."""
    if look().titles and text:
        write(figure, text, 18, 14, 15, weight="bold")
    if look().titles and caption:
        write(figure, caption, 18, 42, 12)


def scale_bar(figure: Figure, pixels_per_m: float, right: float, bottom: float, room: float = 130) -> None:
    """Draw a bar of a round length at the scale of what is in the middle of a picture.

    Args:
        figure: The picture.
        pixels_per_m: Its scale, pixels of the layout.
        right: Where the bar ends, pixels from the left.
        bottom: Where it is, pixels from the top.
        room: How long it may be, pixels.
    """
    length_mm = next((mm for mm in _SCALE_BAR_MM if 1e-3 * mm * pixels_per_m <= room), _SCALE_BAR_MM[-1])
    width, height = figure.get_figwidth() * DPI, figure.get_figheight() * DPI
    left, y = right - 1e-3 * length_mm * pixels_per_m, 1.0 - bottom / height
    figure.add_artist(Line2D([left / width, right / width], [y, y], color=INK, lw=2.5, solid_capstyle="butt"))
    write(figure, f"{length_mm} mm", 0.5 * (left + right), bottom - 20, 10, ha="center")


def canvas(width: int, height: int) -> Figure:
    """Return an empty white figure of a size in pixels, free of any global state."""
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def place(figure: Figure, image: ImageArray, left: int, top: int, size: tuple[int, int]) -> None:
    """Put an image on a figure.

    Args:
        figure: The figure.
        image: RGB, of any resolution.
        left: Its left edge, pixels of the layout.
        top: Its upper edge, pixels from the top.
        size: Width and height that it takes, pixels of the layout.
    """
    width, height = (round(inches * DPI) for inches in (figure.get_figwidth(), figure.get_figheight()))
    if look().resolution == 1 and image.shape[:2] == size[::-1]:  # pixel by pixel
        flipped = np.ascontiguousarray(image[::-1])
        figure.figimage(flipped, left, height - top - size[1], origin="lower")
        return
    box = (left / width, 1.0 - (top + size[1]) / height, size[0] / width, size[1] / height)
    axes = figure.add_axes(box)
    axes.imshow(image, interpolation="none", aspect="auto")
    axes.set_axis_off()


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
    """Write a figure as PNG, and as PDF and SVG where that is asked for; equal pictures are equal files."""
    dpi = DPI * look().resolution
    figure.savefig(path, dpi=dpi, metadata={"Software": None}, pil_kwargs={"compress_level": 4})
    if look().vector:
        figure.savefig(path.with_suffix(".pdf"), dpi=dpi, metadata={"CreationDate": None})
        with mpl.rc_context({"svg.hashsalt": path.stem}):
            figure.savefig(path.with_suffix(".svg"), dpi=dpi, metadata={"Date": None})
    return path
