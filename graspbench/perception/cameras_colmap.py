"""COLMAP's camera files: ``cameras`` and ``images``, as ``.txt`` or ``.bin``.

COLMAP puts the first pixel's centre at 0.5, as here, and writes the motion from the world to the camera. Its
world is arbitrary: the model must be aligned first, so that the table top is the plane z = 0 and lengths
are metres (``colmap model_aligner``).
"""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.errors import ImageError
from graspbench.perception.camera import Intrinsics
from graspbench.perception.placed_image import PlacedImage, camera_to_world, unreadable

FOLDERS = (".", "sparse/0", "sparse", "colmap")
IMAGE_FOLDERS = (".", "images")

Numbers = tuple[float, ...]
T = TypeVar("T")

# Parameters of each model to fx, fy, cx, cy, k1, k2, p1, p2, k3 (colmap/src/colmap/sensor/models.h).
_MODELS: dict[str, tuple[int, int, Callable[[Numbers], Numbers]]] = {
    "SIMPLE_PINHOLE": (0, 3, lambda p: (p[0], p[0], p[1], p[2], 0, 0, 0, 0, 0)),
    "PINHOLE": (1, 4, lambda p: (*p, 0, 0, 0, 0, 0)),
    "SIMPLE_RADIAL": (2, 4, lambda p: (p[0], p[0], p[1], p[2], p[3], 0, 0, 0, 0)),
    "RADIAL": (3, 5, lambda p: (p[0], p[0], p[1], p[2], p[3], p[4], 0, 0, 0)),
    "OPENCV": (4, 8, lambda p: (*p, 0)),
}
_NUMBERS = {number: name for name, (number, _, _) in _MODELS.items()} | {
    5: "OPENCV_FISHEYE", 6: "FULL_OPENCV", 7: "FOV", 8: "SIMPLE_RADIAL_FISHEYE", 9: "RADIAL_FISHEYE",
    10: "THIN_PRISM_FISHEYE",
}  # fmt: skip
_PARAMETERS = {5: 8, 6: 12, 7: 5, 8: 4, 9: 5, 10: 12}


class _Pose(NamedTuple):
    name: str
    camera: int
    quaternion: Numbers
    translation: Numbers


def find_colmap(folder: Path) -> Path | None:
    """Return the folder of a COLMAP model in or below a folder of images, or None."""
    for below in FOLDERS:
        for suffix in (".txt", ".bin"):
            if all((folder / below / f"{name}{suffix}").is_file() for name in ("cameras", "images")):
                return folder / below
    return None


def read_colmap(folder: Path, model: Path) -> list[PlacedImage]:
    """Read a COLMAP model.

    Args:
        folder: Where the images are, or their folder ``images``.
        model: Where the camera files are.

    Raises:
        ImageError: A file is broken, or a camera's model is not supported.
    """
    binary = not (model / "cameras.txt").is_file()
    ending = ".bin" if binary else ".txt"
    read_cameras, read_images = (_binary_cameras, _binary_images) if binary else (_text_cameras, _text_images)
    cameras = _reading(read_cameras, model / f"cameras{ending}")
    placed = []
    for pose in sorted(_reading(read_images, model / f"images{ending}"), key=lambda pose: pose.name):
        if pose.camera not in cameras:
            raise unreadable(
                model / f"images{ending}", f"{pose.name} has camera {pose.camera}, which is missing"
            )
        path = next(
            (folder / below / pose.name for below in IMAGE_FOLDERS if (folder / below / pose.name).is_file()),
            folder / pose.name,
        )
        rotation = Rotation.from_quat(pose.quaternion, scalar_first=True).as_matrix()
        transform = camera_to_world(rotation, np.array(pose.translation))
        placed.append(PlacedImage(Path(pose.name).stem, path, cameras[pose.camera], transform))
    return placed


def _reading(read: Callable[[Path], T], path: Path) -> T:
    try:
        return read(path)
    except (OSError, UnicodeDecodeError, ValueError, IndexError, struct.error) as error:
        raise unreadable(path, str(error).splitlines()[0] if str(error) else "it is cut off") from None


def _intrinsics(model: str, width: int, height: int, parameters: Numbers, path: Path) -> Intrinsics:
    if model not in _MODELS:
        raise ImageError(
            f"{path} has a camera of model {model}, which is not supported",
            remedy=f"undistort the images in COLMAP, or use one of {', '.join(_MODELS)}",
            path=str(path),
        )
    _, count, convert = _MODELS[model]
    if len(parameters) != count:
        raise ValueError(f"a camera of model {model} has {len(parameters)} parameters instead of {count}")
    fx, fy, cx, cy, *distortion = (float(value) for value in convert(parameters))
    k1, k2, p1, p2, k3 = distortion
    if min(width, height, fx, fy) <= 0:
        raise ValueError("a size or focal length is not positive")
    return Intrinsics(width, height, fx, fy, cx, cy, (k1, k2, p1, p2, k3))


def _lines(path: Path) -> list[str]:
    return [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def _text_cameras(path: Path) -> dict[int, Intrinsics]:
    cameras = {}
    for line in filter(str.strip, _lines(path)):
        number, model, width, height, *parameters = line.split()
        cameras[int(number)] = _intrinsics(
            model, int(width), int(height), tuple(float(value) for value in parameters), path
        )
    return cameras


def _text_images(path: Path) -> list[_Pose]:
    # Two lines an image: the second lists its points and may be empty.
    poses = []
    for line in _lines(path)[::2]:
        if not line.strip():
            continue
        fields = line.split(maxsplit=9)
        numbers = tuple(float(value) for value in fields[1:8])
        poses.append(_Pose(fields[9].strip(), int(fields[8]), numbers[:4], numbers[4:]))
    return poses


def _binary_cameras(path: Path) -> dict[int, Intrinsics]:
    data, at = path.read_bytes(), 8
    cameras = {}
    for _ in range(struct.unpack_from("<Q", data)[0]):
        number, model, width, height = struct.unpack_from("<iiQQ", data, at)
        name = _NUMBERS.get(model, str(model))
        count = _MODELS[name][1] if name in _MODELS else _PARAMETERS.get(model, 0)
        parameters = struct.unpack_from(f"<{count}d", data, at + 24)
        at += 24 + 8 * count
        cameras[number] = _intrinsics(name, width, height, parameters, path)
    return cameras


def _binary_images(path: Path) -> list[_Pose]:
    data, at = path.read_bytes(), 8
    poses = []
    for _ in range(struct.unpack_from("<Q", data)[0]):
        _, *numbers = struct.unpack_from("<i7d", data, at)
        (camera,) = struct.unpack_from("<i", data, at + 60)
        end = data.index(b"\0", at + 64)
        name = data[at + 64 : end].decode("utf-8")
        (points,) = struct.unpack_from("<Q", data, end + 1)
        at = end + 9 + 24 * points
        if at > len(data):
            raise ValueError("it is cut off")
        poses.append(_Pose(name, camera, tuple(numbers[:4]), tuple(numbers[4:])))
    return poses
