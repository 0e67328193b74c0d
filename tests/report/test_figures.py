"""Pictures: they are drawn, reproducible, and show what they should."""

import cv2
import numpy as np
import pytest

from graspbench.report import draw_grasp, draw_surface_moments, draw_views, pick_moments, style


def read(path):
    return cv2.imread(str(path))[..., ::-1]


def has(image, color, tolerance=40, least=20):
    near = np.abs(image.astype(int) - 255 * np.array(color)).max(axis=-1) < tolerance
    return near.sum() >= least


def test_views_show_outline_and_box_of_each(tmp_path, trial):
    image = read(draw_views(trial.views, trial.silhouettes, tmp_path / "views.png"))
    for k in range(3):
        tile = image[10:220, 10 + 306 * k : 300 + 306 * k]
        assert has(tile, style.OUTLINE)
        assert has(tile, style.BOX)


def test_view_without_silhouette_is_drawn_plain(tmp_path, trial):
    image = read(draw_views(trial.views, trial.silhouettes[:1], tmp_path / "views.png"))
    assert not has(image[10:220, 320:600], style.BOX)


def test_box_is_drawn_around_the_object(tmp_path, trial):
    image = read(draw_views(trial.views[:1], trial.silhouettes[:1], tmp_path / "views.png"))
    tile = image[6:231, 6:306].astype(int)
    box = np.argwhere(np.abs(tile - 255 * np.array(style.BOX)).max(axis=-1) < 40)
    (top, left), (bottom, right) = box.min(axis=0), box.max(axis=0)
    # 25 x 20 pixels of the view, centred, the higher side at two thirds of the tile.
    assert (right - left) / (bottom - top) == pytest.approx(25 / 20, rel=0.03)
    assert (bottom - top) / 225 == pytest.approx(0.66, abs=0.02)


def test_moments_are_drawn_side_by_side(tmp_path, trial):
    moments = pick_moments(trial.surfaces)
    image = read(draw_surface_moments(moments, tmp_path / "moments.png", title="sphere"))
    assert image.shape[1] == 400 * len(moments)
    widths = [(image[244, 400 * k : 400 * (k + 1)].min(axis=-1) < 200).sum() for k in range(len(moments))]
    assert widths == sorted(widths, reverse=True)
    assert widths[-1] > 40


def test_moments_begin_with_the_ellipsoid_and_end_at_rest(trial):
    moments = pick_moments(trial.surfaces, 3)
    assert [s.iteration for s in moments] == [0, 2, 4]
    assert pick_moments(trial.surfaces[:2], 4) == tuple(trial.surfaces[:2])


def test_grasp_shows_contacts_and_paths(tmp_path, trial, paths):
    surface = trial.surfaces[-1]
    image = read(draw_grasp(surface, trial.grasp, paths, tmp_path / "a.png", title="ball", caption="Q1 = 1"))
    for color in (style.VIA, style.APPROACH, style.GRASP):
        assert has(image[80:], color, 60)


def test_equal_pictures_are_equal_files(tmp_path, trial):
    surface = trial.surfaces[-1]
    a, b = (draw_grasp(surface, trial.grasp, [], tmp_path / name) for name in ("a.png", "b.png"))
    assert a.read_bytes() == b.read_bytes()
