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

Instead of this file the folder may hold a COLMAP model or OpenCV's camera files; see `cameras_colmap` and
`cameras_opencv`. Beside a photograph ``NAME.jpg`` a mask ``NAME_mask.png`` may say where the object is
(brighter than half); then the photograph's colours are not asked.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from graspbench.errors import ConfigurationError, ImageError, StationError
from graspbench.perception.camera import Camera, Intrinsics, View
from graspbench.perception.cameras_colmap import find_colmap, read_colmap
from graspbench.perception.cameras_opencv import find_opencv, read_opencv
from graspbench.perception.image_file import ExifOrientation, read_image, read_mask
from graspbench.perception.placed_image import MASK_ENDING, PlacedImage, check_rigid
from graspbench.perception.stations import MINIMUM_VIEWS
from graspbench.yaml_files import read_yaml

CAMERA_FILES = ("cameras.json", "cameras.yaml", "cameras.yml")

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
        if view.mask is not None:
            cv2.imwrite(str(path / f"{view.station}{MASK_ENDING}.png"), view.mask.astype(np.uint8) * 255)
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


def load_views(folder: Path | str | None, exif: ExifOrientation = "refuse") -> tuple[View, ...]:
    """Read a folder of images and its camera files.

    Args:
        folder: See the module's description.
        exif: What to do with a photograph whose EXIF data say that it is turned: turn it, take its pixels as
            they are stored, or refuse it.

    Raises:
        ImageError: The folder, its camera file, an image or a mask is missing or unreadable.
        StationError: The stations are too few, share a name, or a pose is not rigid.
    """
    if folder is None:
        raise ImageError(
            "no folder of images is given", remedy="set scene.images_dir to one that holds cameras.json"
        )
    path = Path(folder).expanduser()
    placed = _find_cameras(path)
    names = [image.station for image in placed]
    if len(names) < MINIMUM_VIEWS:
        raise StationError(
            f"{len(names)} views in {path} are too few to see an object from all around",
            remedy=f"give at least {MINIMUM_VIEWS}",
            path=str(path),
        )
    doubles = sorted({name for name in names if names.count(name) > 1})
    if doubles:
        raise StationError(f"several views in {path} are called '{doubles[0]}'", path=str(path))
    return tuple(_load_view(image, path, exif) for image in placed)


def _find_cameras(folder: Path) -> list[PlacedImage]:
    """Read the cameras from whatever file there is."""
    own = next((folder / name for name in CAMERA_FILES if (folder / name).is_file()), None)
    if own is not None:
        return _read_own(folder, own)
    if folder.is_dir():
        if (model := find_colmap(folder)) is not None:
            return read_colmap(folder, model)
        if find_opencv(folder):
            return read_opencv(folder)
    raise ImageError(
        f"{folder} holds no {CAMERA_FILES[0]}, no COLMAP model and no camera files of OpenCV",
        remedy="give a folder with images and a file of their cameras",
        path=str(folder),
    )


def _read_own(folder: Path, path: Path) -> list[PlacedImage]:
    document = _read_camera_file(path)
    shift = 0.5 - document.pixel_centre
    placed = []
    for entry in document.views:
        calibration = entry.intrinsics or document.intrinsics
        if calibration is None:
            raise ImageError(
                f"view '{entry.station}' in {folder} has no intrinsics",
                remedy="give them for all views at the top of the camera file, or for each view",
                station=entry.station,
            )
        k = Intrinsics(**asdict(calibration))
        k = replace(k, cx=k.cx + shift, cy=k.cy + shift)
        pose = np.array(entry.transform_camera_to_world)
        placed.append(PlacedImage(entry.station, folder / entry.file, k, pose))
    return placed


def _read_camera_file(path: Path) -> _CameraFile:
    """Parse and check the project's own camera file."""
    try:
        is_json = path.suffix == ".json"
        content: Any = json.loads(path.read_text(encoding="utf-8")) if is_json else read_yaml(path)
        return TypeAdapter(_CameraFile).validate_python(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ImageError(f"{path}: {where or 'document'}: {first['msg']}", path=str(path)) from None
    except ConfigurationError as error:
        raise ImageError(error.what, remedy=error.remedy, path=str(path)) from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        reason = str(error).splitlines()[0]
        raise ImageError(f"{path} cannot be read: {reason}", path=str(path)) from None


def _load_view(placed: PlacedImage, folder: Path, exif: ExifOrientation) -> View:
    """Read one image and its mask, and check them against the camera."""
    k, path = placed.intrinsics, placed.path
    image = read_image(path, exif)
    if image.shape[:2] != (k.height, k.width):
        raise ImageError(
            f"{path} has {image.shape[1]} x {image.shape[0]} pixels, its intrinsics say "
            f"{k.width} x {k.height}",
            remedy="give the camera of these very pixels; see scene.exif_orientation for turned photographs",
            station=placed.station,
        )
    pose = placed.transform_camera_to_world
    check_rigid(pose, placed.station, folder)
    if pose[2, 3] <= 0.0:
        raise StationError(
            f"the camera of view '{placed.station}' in {folder} is below the table (z = {pose[2, 3]:.3g} m)",
            remedy="give poses in a world whose plane z = 0 is the table top, z upwards, lengths in metres",
            station=placed.station,
        )
    return View(placed.station, image, Camera(k, pose), read_mask(path, image.shape[:2], exif))
