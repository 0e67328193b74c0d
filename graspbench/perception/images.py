"""Views as files: a folder of images with a file that says where each was taken.

``cameras.json`` (or ``cameras.yaml``) in the folder reads::

    {
      "schema": 1,
      "pixel_centre": 0.5,
      "intrinsics": {"width": 640, "height": 480, "fx": 750.0, "fy": 750.0, "cx": 320.0, "cy": 240.0,
                     "distortion": [0, 0, 0, 0, 0]},
      "views": [
        {"station": "top", "file": "top.png",
         "transform_camera_to_world": [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.5], [0, 0, 0, 1]]},
        ...
      ]
    }

A view may carry ``intrinsics`` of its own. ``pixel_centre`` is the coordinate of the first pixel's
centre in ``cx`` and ``cy``: 0.5 here, 0 for a calibration by OpenCV. ``distortion`` is k1, k2, p1, p2,
k3, in OpenCV's order. The optical frame has x right, y down, z forward; the table top is the plane
z = 0 of the world.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import numpy as np
import yaml
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from graspbench.arrays import FloatArray, ImageArray
from graspbench.errors import ImageError, StationError
from graspbench.perception.camera import Camera, Intrinsics, View
from graspbench.perception.stations import MINIMUM_VIEWS

CAMERA_FILES = ("cameras.json", "cameras.yaml", "cameras.yml")
_RIGIDITY_TOLERANCE = 1e-4

Row = tuple[float, float, float, float]


@dataclass(frozen=True)
class _IntrinsicsEntry:
    __pydantic_config__ = ConfigDict(extra="forbid", allow_inf_nan=False)

    width: Annotated[int, Field(gt=0)]
    height: Annotated[int, Field(gt=0)]
    fx: Annotated[float, Field(gt=0)]
    fy: Annotated[float, Field(gt=0)]
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class _ViewEntry:
    __pydantic_config__ = ConfigDict(extra="forbid", allow_inf_nan=False)

    station: Annotated[str, Field(min_length=1)]
    file: Annotated[str, Field(min_length=1)]
    transform_camera_to_world: tuple[Row, Row, Row, Row]
    intrinsics: _IntrinsicsEntry | None = None


@dataclass(frozen=True)
class _CameraFile:
    __pydantic_config__ = ConfigDict(extra="forbid", allow_inf_nan=False)

    views: tuple[_ViewEntry, ...]
    intrinsics: _IntrinsicsEntry | None = None
    schema: Literal[1] = 1
    pixel_centre: Annotated[float, Field(ge=0, le=0.5)] = 0.5


def save_views(views: Sequence[View], folder: Path | str) -> None:
    """Write views as PNG images and ``cameras.json``, so that `load_views` gives them back unchanged.

    Args:
        views: With different station names.
        folder: Made if missing; files of the same names are replaced.
    """
    path = Path(folder)
    path.mkdir(parents=True, exist_ok=True)
    entries = []
    for view in views:
        name = f"{view.station}.png"
        if not cv2.imwrite(str(path / name), view.image[..., ::-1]):
            raise ImageError(f"image {path / name} cannot be written", path=str(path / name))
        entries.append(
            {
                "station": view.station,
                "file": name,
                "transform_camera_to_world": view.camera.transform_camera_to_world.tolist(),
                "intrinsics": asdict(view.camera.intrinsics),
            }
        )
    document = {"schema": 1, "pixel_centre": 0.5, "views": entries}
    (path / CAMERA_FILES[0]).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def load_views(folder: Path | str | None) -> tuple[View, ...]:
    """Read a folder of images and its camera file.

    Args:
        folder: See the module's description.

    Raises:
        ImageError: The folder, its camera file or an image is missing or unreadable.
        StationError: The stations are too few, share a name, or a pose is not rigid.
    """
    if folder is None:
        raise ImageError(
            "no folder of images is given", remedy="set scene.images_dir to one that holds cameras.json"
        )
    path = Path(folder).expanduser()
    document = _read_camera_file(path)
    names = [entry.station for entry in document.views]
    if len(names) < MINIMUM_VIEWS:
        raise StationError(
            f"{len(names)} views in {path} are too few to see an object from all around",
            remedy=f"give at least {MINIMUM_VIEWS}",
            path=str(path),
        )
    doubles = sorted({name for name in names if names.count(name) > 1})
    if doubles:
        raise StationError(f"several views in {path} are called '{doubles[0]}'", path=str(path))
    return tuple(_load_view(path, document, entry) for entry in document.views)


def _read_camera_file(folder: Path) -> _CameraFile:
    """Find, parse and check the camera file."""
    path = next((folder / name for name in CAMERA_FILES if (folder / name).is_file()), None)
    if path is None:
        raise ImageError(
            f"{folder} holds no {CAMERA_FILES[0]}",
            remedy="give a folder with images and a file of their cameras",
            path=str(folder),
        )
    try:
        text = path.read_text(encoding="utf-8")
        content: Any = json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)
        return TypeAdapter(_CameraFile).validate_python(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ImageError(f"{path}: {where or 'document'}: {first['msg']}", path=str(path)) from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, yaml.YAMLError) as error:
        reason = str(error).splitlines()[0]
        raise ImageError(f"{path} cannot be read: {reason}", path=str(path)) from None


def _load_view(folder: Path, document: _CameraFile, entry: _ViewEntry) -> View:
    """Read one image and check it against its camera."""
    calibration = entry.intrinsics or document.intrinsics
    if calibration is None:
        raise ImageError(
            f"view '{entry.station}' in {folder} has no intrinsics",
            remedy="give them for all views at the top of the camera file, or for each view",
            station=entry.station,
        )
    shift = 0.5 - document.pixel_centre
    intrinsics = Intrinsics(**asdict(calibration))
    intrinsics = replace(intrinsics, cx=intrinsics.cx + shift, cy=intrinsics.cy + shift)
    image = _read_image(folder / entry.file)
    if image.shape[:2] != (intrinsics.height, intrinsics.width):
        raise ImageError(
            f"{folder / entry.file} has {image.shape[1]} x {image.shape[0]} pixels, its intrinsics say "
            f"{intrinsics.width} x {intrinsics.height}",
            station=entry.station,
        )
    pose = np.array(entry.transform_camera_to_world)
    _check_rigid(pose, entry.station, folder)
    return View(entry.station, image, Camera(intrinsics, pose))


def _read_image(path: Path) -> ImageArray:
    data = np.frombuffer(path.read_bytes(), dtype=np.uint8) if path.is_file() else None
    image = None if data is None or len(data) == 0 else cv2.imdecode(data, cv2.IMREAD_COLOR)
    if image is None:
        raise ImageError(f"image {path} is missing or unreadable", path=str(path))
    return np.ascontiguousarray(image[..., ::-1])


def _check_rigid(pose: FloatArray, station: str, folder: Path) -> None:
    rotation = pose[:3, :3]
    rigid = (
        np.allclose(rotation @ rotation.T, np.eye(3), atol=_RIGIDITY_TOLERANCE)
        and np.linalg.det(rotation) > 0.0
        and np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0))
    )
    if not rigid:
        raise StationError(
            f"the pose of view '{station}' in {folder} is not a rotation and a translation",
            remedy="give transform_camera_to_world as a homogeneous matrix, row by row",
            station=station,
        )
