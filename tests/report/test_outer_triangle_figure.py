import cv2
import numpy as np
import pytest

from graspbench.grasp.configuration import Grasp
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores
from graspbench.report import style
from graspbench.report.outer_triangle_figure import draw_outer_triangle, outer_triangle_corners


def test_corners_of_an_equilateral_triangle():
    angles = np.radians([90.0, 210.0, 330.0])
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    corners = outer_triangle_corners(2.0 * normals, normals)
    # Its inscribed circle has radius 2, so its corners lie 4 from the middle, opposite the contacts.
    np.testing.assert_allclose(corners, -4.0 * np.roll(normals, 1, axis=0), atol=1e-12)


def test_area_of_the_drawn_triangle_is_the_index():
    rng = np.random.default_rng(2)
    angles = np.radians([0.0, 125.0, 235.0])
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    points = 0.03 * normals + rng.uniform(-0.005, 0.005, (3, 2))
    (ax, ay), (bx, by) = np.diff(outer_triangle_corners(points, normals), axis=0)
    in_space = [np.column_stack([array, np.zeros(3)]) for array in (points, normals)]
    assert abs(ax * by - ay * bx) / 2 == pytest.approx(float(mirtich_canny_scores(*in_space)[2]), rel=1e-12)


def test_figure_shows_contacts_paths_and_triangle(tmp_path, trial, paths):
    surface = trial.surfaces[-1]
    vertices = np.array([41, 44, 47])
    grasp = Grasp(vertices, surface.points[vertices], surface.normals[vertices], surface.centroid)
    image = cv2.imread(str(draw_outer_triangle(surface, grasp, paths, tmp_path / "a.png", "ball", "CEI 1")))[
        ..., ::-1
    ].astype(int)
    for half, color in (
        (image[:, :760], style.GRASP),
        (image[:, 760:], style.CONTACT),
        (image[:, 760:], (0, 0.35, 0.65)),
    ):
        near = np.abs(half - 255 * np.array(color)).max(axis=-1) < 40
        assert near.sum() > 50
