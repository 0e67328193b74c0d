"""Colours that differ for the colour-blind and in grey, and a scale bar that is as long as it says."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from graspbench.report import style

# Machado, Oliveira and Fernandes 2009, severity 1, for linear RGB.
SIGHT = {
    "protan": [
        [0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881],
    ],
    "tritan": [
        [1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900],
    ],
    "any": np.eye(3),
}  # fmt: skip
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
MEETING = {
    "lines": style.LINES,
    "grasps": (style.SURFACE, style.CONTACT, style.VIA, style.APPROACH),
    "paths": (style.VIA, style.APPROACH, style.GRASP),
}


def lab(color, sight="any"):
    """Return a colour in CIE L*a*b* as somebody sees it."""
    rgb = np.array(to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.array(SIGHT[sight]) @ linear, 0.0, 1.0)
    x, y, z = np.cbrt(np.maximum(TO_XYZ @ seen / (TO_XYZ @ np.ones(3)), 1e-6))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("names", MEETING)
@pytest.mark.parametrize("sight", SIGHT)
def test_colours_that_meet_are_told_apart_by_everybody(names, sight):
    for first, second in combinations(MEETING[names], 2):
        assert np.linalg.norm(lab(first, sight) - lab(second, sight)) > 20.0, (first, second)


@pytest.mark.parametrize("names", MEETING)
def test_colours_that_meet_differ_in_grey(names):
    lightness = sorted(lab(color)[0] for color in MEETING[names])
    assert np.diff(lightness).min() > 11.0, lightness


def test_lines_are_seen_on_white():
    assert max(lab(color)[0] for color in style.LINES) < 78.0


@pytest.mark.parametrize("pixels_per_m", [300.0, 1500.0, 9000.0])
def test_a_scale_bar_is_as_long_as_it_says(pixels_per_m):
    figure = style.canvas(400, 300)
    style.scale_bar(figure, pixels_per_m, 380.0, 280.0)
    (bar,), (text,) = figure.lines or figure.artists, figure.texts
    drawn = np.ptp(bar.get_xdata()) * 400
    said = float(text.get_text().removesuffix(" mm"))
    assert drawn == pytest.approx(1e-3 * said * pixels_per_m)
    assert 10.0 < drawn <= 130.0
