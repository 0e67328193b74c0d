"""What a format of grasp files is, and which there are."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import OutputError
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.reading import AS_STATED, Reading
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.geometry.model import ObjectModel
from graspbench.hand.model import HandModel
from graspbench.registry import Registry

MAX_FILE_BYTES = 1 << 30


@dataclass(frozen=True, eq=False)
class FormatContext:
    """What a file of grasps is read for.

    Attributes:
        hand: The hand; files state its joints and its frame in ways of their own.
        object_model: The object; files state poses in the frame of its mesh file.
        object_scale: Metres per unit of the object's mesh file.
        reading: How the numbers are taken; only as stated unless a file is known to be wrong.
    """

    hand: HandModel
    object_model: ObjectModel
    object_scale: float = 1.0
    reading: Reading = AS_STATED

    def transform_file_to_object(self, scale: float) -> FloatArray:
        """Return the pose of the mesh file's frame in the object's own frame, shape (4, 4), at a scale."""
        known = self.object_model.transform_file_to_object
        transform = np.eye(4) if known is None else known.copy()
        transform[:3, 3] *= scale / self.object_scale
        return transform


class GraspFormat(Protocol):
    """Reads and writes files of grasps."""

    description: str
    """What the format is, one line."""

    suffixes: tuple[str, ...]
    """What its files' names end in."""

    def recognises(self, path: Path) -> bool:
        """Tell by a look into a file with one of the suffixes whether it is of this format."""
        ...

    def read(self, path: Path, context: FormatContext) -> tuple[GraspRecord, ...]:
        """Return the grasps of a file, joints in the hand's order, poses in the object's frame.

        Raises:
            GraspFileError: The file cannot be read, or does not fit; the sentence says where.
        """
        ...

    def write(self, path: Path, records: Sequence[GraspRecord], context: FormatContext) -> None:
        """Write grasps to a file, or as a folder of files where the format has one file a grasp.

        Raises:
            GraspFileError: The format cannot hold a grasp that has no hand.
            OutputError: The file cannot be written.
        """
        ...


FORMATS: Registry[GraspFormat] = Registry("grasp_format", "graspbench.evaluation.formats")


def read_grasps(path: Path, context: FormatContext, name: str | None = None) -> tuple[GraspRecord, ...]:
    """Read a file of grasps, or all files of a folder.

    Args:
        path: The file or folder.
        context: Hand and object.
        name: The format; None finds out.

    Raises:
        GraspFileError: There is no such file, it is of no known format, or it cannot be used.
    """
    if path.is_dir():
        suffixes = {suffix for each in FORMATS for suffix in FORMATS[each].suffixes}
        files = sorted(file for file in path.rglob("*") if file.is_file() and file.suffix in suffixes)
        if not files:
            raise GraspFileError(
                f"folder {path} holds no file of grasps", remedy=f"give files that end in {_listed(suffixes)}"
            )
        return tuple(record for file in files for record in read_grasps(file, context, name))
    if not path.is_file():
        raise GraspFileError(f"there is no file {path}", remedy="correct its path", path=str(path))
    if (size := path.stat().st_size) > MAX_FILE_BYTES:
        raise GraspFileError(f"{path} is too large ({size >> 20} MB)", remedy="split it", path=str(path))
    chosen = FORMATS[name] if name is not None else FORMATS[format_of(path)]
    records = chosen.read(path, context)
    if not records:
        raise GraspFileError(f"{path} holds no grasp", remedy="give a file with at least one")
    return records


def format_of(path: Path) -> str:
    """Return the format of a file by its name and a look into it.

    Raises:
        GraspFileError: It is of none that is known.
    """
    for name in FORMATS:
        if path.suffix in FORMATS[name].suffixes and FORMATS[name].recognises(path):
            return name
    raise GraspFileError(
        f"{path} is of no known format of grasps",
        remedy=f"say which one it is with --format: {', '.join(FORMATS.names())}",
        path=str(path),
    )


def write_grasps(path: Path, records: Sequence[GraspRecord], context: FormatContext, name: str) -> None:
    """Write grasps in a format; see `GraspFormat.write`.

    Raises:
        OutputError: The file cannot be written.
    """
    chosen = FORMATS[name]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        chosen.write(path, records, context)
    except OSError as error:
        raise OutputError(
            f"{path} cannot be written ({error.strerror or error})", remedy="give another path with --output"
        ) from error


def describe_formats() -> list[dict[str, str]]:
    """Return what each format is, in rows."""
    return [
        {"name": name, "files": ", ".join(FORMATS[name].suffixes), "description": FORMATS[name].description}
        for name in FORMATS
    ]


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(names))
