import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.geometry.extrusion import inset
from graspbench.geometry.outline import rounded_polyline

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def area(points):
    x, y = points.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


@pytest.mark.parametrize("radius", [0.1, 0.3, 0.49])
def test_rounding_a_square_takes_its_corners_off(radius):
    points = rounded_polyline(SQUARE, [radius] * 4, 0.01, closed=True)
    assert area(points) == pytest.approx(1.0 - (4.0 - np.pi) * radius**2, abs=2e-4)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    assert steps.max() <= 0.01 + 1e-9


def test_an_open_line_keeps_its_ends_and_its_sharp_corners():
    line = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]])
    points = rounded_polyline(line, [0.0, 0.0, 0.0], 0.3)
    np.testing.assert_array_equal(points[[0, -1]], line[[0, -1]])
    assert (points == line[1]).all(axis=1).sum() == 1


def test_arcs_that_overlap_are_refused():
    with pytest.raises(ConfigurationError, match="does not fit"):
        rounded_polyline(SQUARE, [0.6] * 4, 0.1, closed=True)


def test_coinciding_corners_are_refused():
    with pytest.raises(ConfigurationError, match="coincide"):
        rounded_polyline(SQUARE[[0, 1, 1, 2]], [0.0] * 4, 0.1)


def test_inset_moves_every_side_by_the_distance():
    np.testing.assert_allclose(inset(SQUARE, 0.2), 0.2 + 0.6 * SQUARE)
    with pytest.raises(ConfigurationError, match="rounder"):
        inset(SQUARE, 0.6)
