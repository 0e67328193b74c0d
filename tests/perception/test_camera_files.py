import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from graspbench.errors import ImageError, StationError
from graspbench.perception import Camera, CameraParameters, SilhouetteParameters, View, silhouettes
from graspbench.perception.images import load_views, save_views
from graspbench.perception.stations import StationParameters, place_stations
from graspbench.reconstruction import SurfaceParameters, VisualHull, reconstruct
from tests.oracles.rasterise import exact_silhouettes
from tests.oracles.scenes import scene

INTRINSICS = CameraParameters(
    width=64, height=48, fx=70, fy=71, cx=30.5, distortion=(0.1, 0.02, 1e-3, 2e-3, 0)
).intrinsics


@pytest.fixture
def views():
    generator = np.random.default_rng(0)
    return [
        View(
            f"view-{k}",
            generator.integers(0, 256, (48, 64, 3), dtype=np.uint8),
            Camera(INTRINSICS, station.transform_camera_to_world),
        )
        for k, station in enumerate(place_stations(np.zeros(3), StationParameters())[:4])
    ]


@pytest.fixture
def folder(views, tmp_path):
    save_views(views, tmp_path)
    (tmp_path / "cameras.json").unlink()
    return tmp_path


def world_to_camera(view):
    matrix = np.linalg.inv(view.camera.transform_camera_to_world)
    return Rotation.from_matrix(matrix[:3, :3]), matrix[:3, 3]


def write_colmap_text(views, folder):
    k = INTRINSICS
    parameters = (k.fx, k.fy, k.cx, k.cy, *k.distortion[:4])
    (folder / "cameras.txt").write_text(
        "# Camera list\n1 OPENCV 64 48 " + " ".join(map(repr, parameters)) + "\n"
    )
    lines = ["# Image list"]
    for number, view in enumerate(reversed(views)):
        rotation, translation = world_to_camera(view)
        numbers = [*rotation.as_quat(scalar_first=True), *translation]
        lines += [f"{number} {' '.join(map(repr, map(float, numbers)))} 1 {view.station}.png"]
        lines += ["1.5 2.5 -1" if number % 2 else ""]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")


def write_colmap_binary(views, folder, model=4):
    k = INTRINSICS
    parameters = (k.fx, k.fy, k.cx, k.cy, *k.distortion[:4])
    sparse = folder / "sparse" / "0"
    sparse.mkdir(parents=True)
    (sparse / "cameras.bin").write_bytes(
        struct.pack("<Q", 1) + struct.pack("<iiQQ", 1, model, 64, 48) + struct.pack("<8d", *parameters)
    )
    content = struct.pack("<Q", len(views))
    for number, view in enumerate(views):
        rotation, translation = world_to_camera(view)
        content += struct.pack("<i7di", number, *rotation.as_quat(scalar_first=True), *translation, 1)
        content += f"{view.station}.png".encode() + b"\0"
        content += struct.pack("<Q", 2) + struct.pack("<ddqddq", 1, 2, -1, 3, 4, 7)
    (sparse / "images.bin").write_bytes(content)


def opencv_matrix():
    k = INTRINSICS
    return np.array([[k.fx, 0, k.cx - 0.5], [0, k.fy, k.cy - 0.5], [0, 0, 1]])


def write_opencv_single(views, folder, suffix=".yml", as_matrix=False):
    for view in views:
        rotation, translation = world_to_camera(view)
        storage = cv2.FileStorage(str(folder / f"{view.station}{suffix}"), cv2.FILE_STORAGE_WRITE)
        storage.write("camera_matrix", opencv_matrix())
        storage.write("distortion_coefficients", np.array([INTRINSICS.distortion]))
        if as_matrix:
            storage.write("R", rotation.as_matrix())
            storage.write("T", translation[:, None])
        else:
            storage.write("rvec", rotation.as_rotvec()[:, None])
            storage.write("tvec", translation[:, None])
        storage.release()


def write_opencv_shared(views, folder, suffix=".xml"):
    rows = [np.concatenate((r.as_rotvec(), t)) for r, t in map(world_to_camera, views)]
    storage = cv2.FileStorage(str(folder / f"calibration{suffix}"), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 64)
    storage.write("image_height", 48)
    storage.write("camera_matrix", opencv_matrix())
    storage.write("distortion_coefficients", np.array(INTRINSICS.distortion)[:, None])
    storage.write("extrinsic_parameters", np.array(rows))
    storage.release()


@pytest.mark.parametrize(
    "write",
    [
        write_colmap_text,
        write_colmap_binary,
        write_opencv_single,
        lambda views, folder: write_opencv_single(views, folder, ".xml", as_matrix=True),
        write_opencv_shared,
        lambda views, folder: write_opencv_shared(views, folder, ".yaml"),
    ],
)
def test_every_camera_file_gives_the_same_views(write, views, folder):
    write(views, folder)
    loaded = load_views(folder)
    assert [view.station for view in loaded] == [view.station for view in views]
    for before, after in zip(views, loaded, strict=True):
        np.testing.assert_array_equal(before.image, after.image)
        np.testing.assert_allclose(
            after.camera.transform_camera_to_world, before.camera.transform_camera_to_world, atol=1e-12
        )
        k = after.camera.intrinsics
        assert (k.width, k.height, k.fx, k.fy) == (64, 48, 70, 71)
        np.testing.assert_allclose((k.cx, k.cy, *k.distortion), (30.5, 24, 0.1, 0.02, 1e-3, 2e-3, 0))


def spoil(folder, name, change):
    path = folder / name
    path.write_bytes(change(path.read_bytes()))


@pytest.mark.parametrize(
    ("write", "name", "change", "message"),
    [
        (
            write_colmap_text,
            "cameras.txt",
            lambda b: b.replace(b"OPENCV", b"FOV"),
            "model FOV.*not supported",
        ),
        (write_colmap_text, "cameras.txt", lambda b: b.replace(b" 64 ", b" 64.5 "), "cannot be read"),
        (write_colmap_text, "cameras.txt", lambda b: b"2" + b[len(b"# Camera list\n1") :], "cannot be read"),
        (write_colmap_text, "images.txt", lambda b: b.replace(b" 1 view", b" 9 view"), "camera 9"),
        (
            write_colmap_text,
            "images.txt",
            lambda b: b.replace(b"view-1.png", b"gone.png"),
            "gone.png is missing",
        ),
        (write_colmap_binary, "sparse/0/images.bin", lambda b: b[:-30], "cut off|cannot be read"),
        (
            lambda views, folder: write_colmap_binary(views, folder, model=5),
            "sparse/0/cameras.bin",
            lambda b: b,
            "OPENCV_FISHEYE.*not supported",
        ),
        (
            write_opencv_single,
            "view-1.yml",
            lambda b: b.replace(b"camera_matrix", b"camera"),
            "camera_matrix",
        ),
        (write_opencv_single, "view-1.yml", lambda b: b.replace(b"tvec", b"tve"), "tvec or T"),
        (write_opencv_single, "view-1.yml", lambda b: b"nonsense", "cannot be read"),
        (
            write_opencv_shared,
            "calibration.xml",
            lambda b: b.replace(b"<rows>4", b"<rows>3"),
            "cannot be read",
        ),
    ],
)
def test_a_broken_camera_file_is_one_clear_sentence(write, name, change, message, views, folder):
    write(views, folder)
    spoil(folder, name, change)
    with pytest.raises(ImageError, match=message) as raised:
        load_views(folder)
    assert "\n" not in str(raised.value)


def test_a_view_without_its_camera_file_and_a_world_upside_down_are_named(views, folder):
    write_opencv_single(views, folder)
    (folder / "view-2.yml").unlink()
    with pytest.raises(ImageError, match=r"view-2\.png has no camera file"):
        load_views(folder)
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    below = [replace_pose(view, turned @ view.camera.transform_camera_to_world) for view in views]
    write_opencv_single(below, folder)
    with pytest.raises(StationError, match="below the table"):
        load_views(folder)


def replace_pose(view, pose):
    return replace(view, camera=Camera(view.camera.intrinsics, pose))


def test_turned_photographs_are_never_taken_in_silence(views, folder):
    write_colmap_text(views, folder)
    stored = views[0].image
    exif = Image.Exif()
    exif[0x0112] = 3
    Image.fromarray(stored).save(folder / "view-0.png", exif=exif)
    with pytest.raises(ImageError, match=r"turned by its EXIF data \(orientation 3\).*exif_orientation"):
        load_views(folder)
    np.testing.assert_array_equal(load_views(folder, "ignore")[0].image, stored)
    np.testing.assert_array_equal(load_views(folder, "honour")[0].image, stored[::-1, ::-1])


def test_a_quarter_turn_needs_the_camera_of_the_turned_picture(views, folder):
    write_colmap_text(views, folder)
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(np.rot90(views[0].image)).save(folder / "view-0.png", exif=exif)
    with pytest.raises(ImageError, match="48 x 64 pixels, its intrinsics say 64 x 48"):
        load_views(folder, "ignore")
    np.testing.assert_array_equal(load_views(folder, "honour")[0].image, views[0].image)


def test_masks_beside_photographs_decide(views, folder):
    inside = np.zeros((48, 64), dtype=np.bool_)
    inside[10:30, 20:50] = True
    inside[15:20, 30:40] = False
    plain = replace(INTRINSICS, distortion=(0.0,) * 5)
    masked = [
        replace(v, camera=Camera(plain, v.camera.transform_camera_to_world), mask=inside) for v in views
    ]
    save_views(masked, folder)
    found = silhouettes(load_views(folder), SilhouetteParameters())
    for silhouette in found:
        np.testing.assert_array_equal(silhouette.image_mask, inside)
        assert silhouette.holes == 1
    cv2.imwrite(str(folder / "view-1_mask.png"), np.zeros((48, 60), np.uint8))
    with pytest.raises(ImageError, match="60 x 48 pixels, its image 64 x 48"):
        load_views(folder)
    cv2.imwrite(str(folder / "view-1_mask.png"), np.zeros((48, 64), np.uint8))
    with pytest.raises(ImageError, match="mask of station view-1 is empty"):
        silhouettes(load_views(folder), SilhouetteParameters())


def test_what_a_mask_cuts_at_the_border_is_not_carved_away():
    shapes = scene("egg")
    near = []
    for k, silhouette in enumerate(shapes.silhouettes):
        camera = silhouette.camera
        if k == 1:  # turned aside: the object leaves this image on one side
            pose = camera.transform_camera_to_world.copy()
            pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("y", 30, degrees=True).as_matrix()
            camera = Camera(camera.intrinsics, pose)
        wide = replace(camera.intrinsics, width=960, cx=camera.intrinsics.cx + 320)
        placed = {silhouette.station: Camera(wide, camera.transform_camera_to_world)}
        (whole,) = exact_silhouettes(shapes.mesh.vertices, shapes.mesh.faces, placed)
        mask = whole.mask[:, 320:640]
        near.append(View(silhouette.station, np.zeros((240, 320, 3), np.uint8), camera, mask))
    found = silhouettes(near, SilhouetteParameters())
    assert [s.margin_px > 0 for s in found] == [k == 1 for k in range(len(found))]
    np.testing.assert_array_equal(found[1].image_mask, near[1].mask)
    inner = shapes.mesh.center_mass + 0.95 * (shapes.mesh.vertices - shapes.mesh.center_mass)
    assert VisualHull(found).contains(inner).all()
    *_, surface = reconstruct(found, SurfaceParameters(nodes=227))
    gaps = np.linalg.norm(surface.points[:, None] - shapes.mesh.vertices[None], axis=2).min(axis=1)
    assert np.median(gaps) < 3e-3
