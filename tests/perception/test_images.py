import json

import cv2
import numpy as np
import pytest
import yaml

from graspbench.errors import ImageError, StationError
from graspbench.perception import Camera, CameraParameters, StationParameters, View, place_stations
from graspbench.perception.images import load_views, save_views

INTRINSICS = CameraParameters(width=64, height=48, cx=30.5, distortion=(0.1, 0, 0, 0, 0)).intrinsics


@pytest.fixture
def views():
    generator = np.random.default_rng(0)
    return [
        View(
            station.name,
            generator.integers(0, 256, (48, 64, 3), dtype=np.uint8),
            Camera(INTRINSICS, station.transform_camera_to_world),
        )
        for station in place_stations(np.zeros(3), StationParameters())[:4]
    ]


@pytest.fixture
def folder(views, tmp_path):
    save_views(views, tmp_path / "images")
    return tmp_path / "images"


def edit(folder, change):
    path = folder / "cameras.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def test_views_come_back_unchanged(views, folder):
    loaded = load_views(folder)
    assert [v.station for v in loaded] == [v.station for v in views]
    for before, after in zip(views, loaded, strict=True):
        np.testing.assert_array_equal(before.image, after.image)
        np.testing.assert_array_equal(
            before.camera.transform_camera_to_world, after.camera.transform_camera_to_world
        )
        assert before.camera.intrinsics == after.camera.intrinsics


def test_yaml_and_shared_intrinsics_and_opencvs_pixel_centres(folder):
    document = json.loads((folder / "cameras.json").read_text())
    shared = [view.pop("intrinsics") for view in document["views"]]
    document["intrinsics"] = shared[-1]
    document["pixel_centre"] = 0
    (folder / "cameras.json").unlink()
    (folder / "cameras.yaml").write_text(yaml.safe_dump(document))
    camera = load_views(folder)[0].camera
    assert camera.intrinsics.cx == INTRINSICS.cx + 0.5
    assert camera.intrinsics.cy == INTRINSICS.cy + 0.5


def test_other_image_formats_can_be_read(folder):
    image = np.full((48, 64, 3), (10, 20, 30), np.uint8)
    cv2.imwrite(str(folder / "a.bmp"), image)
    edit(folder, lambda d: d["views"][0].update(file="a.bmp"))
    assert tuple(load_views(folder)[0].image[0, 0]) == (30, 20, 10)


@pytest.mark.parametrize(
    ("change", "kind", "message"),
    [
        (lambda d: d["views"].__delitem__(slice(2, None)), StationError, "2 views in .* are too few"),
        (lambda d: d["views"][0].update(file="gone.png"), ImageError, "gone.png is missing"),
        (lambda d: d["views"][1].update(station="top"), StationError, "several views .* 'top'"),
        (lambda d: d["views"][1].pop("file"), ImageError, "views.1.file: Field required"),
        (lambda d: d["views"][1].update(flie="x"), ImageError, "flie"),
        (lambda d: d["views"][1].pop("intrinsics"), ImageError, "'outer-0' .* has no intrinsics"),
        (lambda d: d["views"][1]["intrinsics"].update(width=63), ImageError, "64 x 48 pixels"),
        (lambda d: d["views"][1]["intrinsics"].update(fx=-3), ImageError, "greater than 0"),
        (lambda d: d["views"][1]["transform_camera_to_world"][0].__setitem__(0, 2), StationError, "rotation"),
        (lambda d: d.update(schema=2), ImageError, "schema"),
    ],
)
def test_a_wrong_camera_file_is_one_clear_sentence(folder, change, kind, message):
    edit(folder, change)
    with pytest.raises(kind, match=message) as raised:
        load_views(folder)
    assert "\n" not in str(raised.value)


def test_missing_or_broken_files_are_named(folder, tmp_path):
    with pytest.raises(ImageError, match="no folder"):
        load_views(None)
    with pytest.raises(ImageError, match=r"holds no cameras\.json"):
        load_views(tmp_path)
    (folder / "top.png").write_bytes(b"no image")
    with pytest.raises(ImageError, match=r"top\.png is missing or unreadable"):
        load_views(folder)
    (folder / "cameras.json").write_text("{")
    with pytest.raises(ImageError, match="cannot be read"):
        load_views(folder)
