from dataclasses import replace

import cv2
import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.perception import Camera, CameraParameters, look_at
from graspbench.simulation.colours import CLOTHS, contrasting_cloth, scene_colours
from graspbench.simulation.scene import SceneParameters
from graspbench.simulation.table import build_table
from tests.simulation.bodies import box

SCENE = SceneParameters(shadow=0.0, table_rgb=(0.12, 0.45, 0.25), table_second_rgb=(0.10, 0.32, 0.42))
MESH = box().mesh
VERTICES = MESH.vertices + np.array([0.0, 0.0, 0.05])
CAMERA = Camera(CameraParameters().intrinsics, look_at(np.array([0.4, -0.3, 0.3]), np.zeros(3)))


def table(scene, seed=0):
    return build_table(scene, scene_colours(scene, (0.8, 0.3, 0.2)), VERTICES, MESH.faces, seed)


def colour_at(image, point):
    u, v = CAMERA.project(np.array([point]))[0]
    return image[int(v), int(u)].astype(float)


def test_each_pixel_shows_the_point_of_the_table_on_its_ray():
    drawn = table(replace(SCENE, table="checker", table_pattern_m=0.1))
    image = drawn.image(CAMERA.intrinsics, CAMERA.transform_camera_to_world)
    generator = np.random.default_rng(0)
    colours = {}
    for x, y in generator.uniform(-0.12, 0.12, (300, 2)):
        if min(x % 0.1, -x % 0.1, y % 0.1, -y % 0.1) < 0.006:
            continue
        even = (np.floor(x / 0.1) + np.floor(y / 0.1)) % 2 == 0
        colours.setdefault(even, []).append(colour_at(image, (x, y, 0.0)))
    assert np.ptp(colours[True], axis=0).max() <= 1.0
    assert np.ptp(colours[False], axis=0).max() <= 1.0
    assert np.abs(np.mean(colours[True], axis=0) - np.mean(colours[False], axis=0)).max() > 10.0


def test_colours_are_the_scenes_under_its_light():
    scene = replace(SCENE, table_rgb=(0.4, 0.2, 0.6), wall_rgb=(0.1, 0.5, 0.3), light_elevation_deg=90.0)
    level = look_at(np.array([0.9, 0.0, 0.1]), np.array([0.0, 0.0, 0.1]))
    image = table(scene).image(CAMERA.intrinsics, level)
    light = scene.ambient + scene.diffuse
    np.testing.assert_allclose(image[470, 320], 255 * light * np.array([0.4, 0.2, 0.6]), atol=1.0)
    np.testing.assert_allclose(image[10, 320], 255 * light * np.array([0.1, 0.5, 0.3]), atol=1.0)


def test_the_shadow_lies_where_the_object_hides_the_lamp():
    scene = replace(SCENE, shadow=1.0, light_azimuth_deg=0.0, light_elevation_deg=45.0, shadow_blur_m=0.001)
    drawn = table(scene)

    def brightness(x, y):
        texel = (np.array([y, x]) / drawn.size_m + 0.5) * len(drawn.texture)
        return drawn.texture[tuple(texel.astype(int))].astype(float) / 255.0 / scene.table_rgb

    lit = scene.ambient + scene.diffuse * np.sin(np.pi / 4)
    # A box of 100 mm under a lamp at 45 deg throws 100 mm of shadow away from the lamp.
    np.testing.assert_allclose(brightness(-0.12, 0.0), scene.ambient, atol=0.02)
    np.testing.assert_allclose(brightness(-0.14, 0.0), lit, atol=0.02)
    np.testing.assert_allclose(brightness(0.04, 0.0), lit, atol=0.02)
    np.testing.assert_allclose(brightness(-0.08, 0.03), lit, atol=0.02)


@pytest.mark.parametrize("pattern", ["wood", "speckle"])
def test_patterns_mix_the_two_colours_by_the_seed(pattern):
    scene = replace(SCENE, table=pattern)
    texture = table(scene, 1).texture.astype(float) / 255.0
    light = scene.ambient + scene.diffuse * np.sin(np.radians(scene.light_elevation_deg))
    low = np.minimum(scene.table_rgb, scene.table_second_rgb) * light
    high = np.maximum(scene.table_rgb, scene.table_second_rgb) * light
    assert np.all(texture >= low - 0.01)
    assert np.all(texture <= high + 0.01)
    assert np.ptp(texture, axis=(0, 1)).min() > 0.5 * (high - low).min()
    np.testing.assert_array_equal(table(scene, 1).texture, table(scene, 1).texture)
    if pattern == "speckle":
        assert np.any(table(scene, 1).texture != table(scene, 2).texture)


def test_an_image_file_can_be_the_table(tmp_path):
    picture = np.zeros((10, 10, 3), np.uint8)
    picture[:5] = (0, 0, 255)
    cv2.imwrite(str(tmp_path / "cloth.png"), picture)
    texture = table(replace(SCENE, table=str(tmp_path / "cloth.png"))).texture
    assert texture[100, 600, 0] > 200
    assert texture[1200, 600].max() == 0


def test_an_unknown_table_is_refused():
    with pytest.raises(ConfigurationError, match="'marble' is no pattern and no readable image"):
        table(replace(SCENE, table="marble"))


@pytest.mark.parametrize("cloth", CLOTHS)
def test_an_object_of_a_cloths_colour_gets_another_cloth(cloth):
    chosen = np.array(contrasting_cloth((*cloth, 1.0)))
    along = chosen @ cloth / (np.linalg.norm(chosen) * np.linalg.norm(cloth))
    assert along < 0.95


def test_colours_left_open_follow_the_table():
    plain = scene_colours(SceneParameters(), (0.8, 0.3, 0.2, 1.0))
    assert plain.first == plain.wall == contrasting_cloth((0.8, 0.3, 0.2))
    board = scene_colours(SceneParameters(table="checker", table_rgb=(0.5, 0.5, 0.2)), (0.8, 0.3, 0.2))
    assert board.first == (0.5, 0.5, 0.2)
    assert sum(board.second) < sum(board.first)
    assert board.wall != board.first
