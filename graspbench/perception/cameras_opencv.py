"""OpenCV's camera files (FileStorage, YAML or XML).

Either one file an image, ``NAME.yml`` (.yaml, .xml) beside ``NAME.png``, with ``camera_matrix``,
``distortion_coefficients`` and the motion from the world to the camera as ``rvec`` or ``R`` and ``tvec`` or
``T``; or one file ``calibration.yml`` (.yaml, .xml) as OpenCV's calibration sample writes it, whose
``extrinsic_parameters`` has one row of rvec and tvec for each image, in the order of ``images`` if the file
has such a list, else in the alphabetical order of the image files. OpenCV puts the first pixel's centre at 0.
"""

from pathlib import Path

import cv2
import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ImageError
from graspbench.perception.camera import Intrinsics
from graspbench.perception.placed_image import PlacedImage, camera_to_world, image_files, unreadable

SHARED = "calibration"
SUFFIXES = (".yml", ".yaml", ".xml")

_MATRIX = ("camera_matrix", "K")
_DISTORTION = ("distortion_coefficients", "dist_coeffs", "D")
_ROTATION = ("rvec", "R")
_TRANSLATION = ("tvec", "T")
_PIXEL_SHIFT = 0.5
_SUPPORTED = 5


def find_opencv(folder: Path) -> bool:
    """Tell whether a folder has OpenCV's camera files."""
    names = [path.with_suffix(suffix) for path in image_files(folder) for suffix in SUFFIXES]
    return any(path.is_file() for path in [folder / f"{SHARED}{suffix}" for suffix in SUFFIXES] + names)


def read_opencv(folder: Path) -> list[PlacedImage]:
    """Read the cameras of a folder's images.

    Raises:
        ImageError: A file or an entry is missing or broken.
    """
    shared = next((folder / f"{SHARED}{s}" for s in SUFFIXES if (folder / f"{SHARED}{s}").is_file()), None)
    return _read_single(folder) if shared is None else _read_shared(folder, shared)


def _read_single(folder: Path) -> list[PlacedImage]:
    placed = []
    for image in image_files(folder):
        path = next((p for p in (image.with_suffix(s) for s in SUFFIXES) if p.is_file()), None)
        if path is None:
            raise ImageError(
                f"{image} has no camera file {image.stem}.yml beside it",
                remedy=f"give one for each image, or one {SHARED}.yml for all",
                path=str(image),
            )
        storage = _open(path)
        rotation = _required(storage, _ROTATION, path)
        translation = _required(storage, _TRANSLATION, path)
        placed.append(_placed(image, _intrinsics(storage, path, image), rotation, translation, path))
    return placed


def _read_shared(folder: Path, path: Path) -> list[PlacedImage]:
    storage = _open(path)
    rows = _required(storage, ("extrinsic_parameters",), path)
    listed = storage.getNode("images")
    images = (
        [folder / listed.at(k).string() for k in range(listed.size())]
        if listed.isSeq()
        else image_files(folder)
    )
    if rows.shape != (len(images), 6):
        raise unreadable(
            path,
            f"extrinsic_parameters is {len(rows)} x {rows.shape[-1]}, where {len(images)} x 6 is due",
        )
    return [
        _placed(image, _intrinsics(storage, path, image), row[:3], row[3:], path)
        for image, row in zip(images, rows, strict=True)
    ]


def _open(path: Path) -> cv2.FileStorage:
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except (cv2.error, SystemError):
        raise unreadable(path, "it is no file that OpenCV's FileStorage reads") from None
    if not storage.isOpened():
        raise unreadable(path, "it is no file that OpenCV's FileStorage reads")
    return storage


def _required(storage: cv2.FileStorage, names: tuple[str, ...], path: Path) -> FloatArray:
    value = _optional(storage, names, path)
    if value is None:
        raise unreadable(path, f"there is no {' or '.join(names)}")
    return value


def _optional(storage: cv2.FileStorage, names: tuple[str, ...], path: Path) -> FloatArray | None:
    for name in names:
        node = storage.getNode(name)
        if node.isMap():
            try:
                return np.asarray(node.mat(), dtype=np.float64)
            except cv2.error:
                raise unreadable(path, f"{name} is no matrix") from None
        if node.isSeq():
            return np.array([node.at(k).real() for k in range(node.size())])
    return None


def _intrinsics(storage: cv2.FileStorage, path: Path, image: Path) -> Intrinsics:
    matrix = _required(storage, _MATRIX, path)
    if matrix.shape != (3, 3) or abs(matrix[0, 1]) > 1e-9 or min(matrix[0, 0], matrix[1, 1]) <= 0.0:
        raise unreadable(path, "the camera matrix is no [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    found = _optional(storage, _DISTORTION, path)
    terms = np.zeros(_SUPPORTED) if found is None else found.ravel()
    if np.any(terms[_SUPPORTED:] != 0.0):
        raise ImageError(
            f"{path} has distortion coefficients beyond k1, k2, p1, p2, k3, which are not supported",
            remedy="calibrate without the rational and the thin prism model",
            path=str(path),
        )
    k1, k2, p1, p2, k3 = (float(value) for value in np.pad(terms, (0, _SUPPORTED))[:_SUPPORTED])
    width, height = (int(storage.getNode(name).real()) for name in ("image_width", "image_height"))
    if width <= 0 or height <= 0:
        size = cv2.haveImageReader(str(image)) and cv2.imread(str(image), cv2.IMREAD_UNCHANGED)
        if size is None or size is False:
            raise ImageError(f"image {image} is missing or unreadable", path=str(image))
        height, width = np.asarray(size).shape[:2]
    return Intrinsics(
        width,
        height,
        float(matrix[0, 0]),
        float(matrix[1, 1]),
        float(matrix[0, 2]) + _PIXEL_SHIFT,
        float(matrix[1, 2]) + _PIXEL_SHIFT,
        (k1, k2, p1, p2, k3),
    )


def _placed(
    image: Path, intrinsics: Intrinsics, rotation: FloatArray, translation: FloatArray, path: Path
) -> PlacedImage:
    if rotation.size == 3:
        rotation = np.asarray(cv2.Rodrigues(rotation.reshape(3, 1))[0], dtype=np.float64)
    if rotation.shape != (3, 3) or translation.size != 3:
        raise unreadable(path, "a rotation has 3 or 3 x 3 numbers, a translation 3")
    return PlacedImage(image.stem, image, intrinsics, camera_to_world(rotation, translation.ravel()))
