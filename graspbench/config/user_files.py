"""The files of the user's that a trial reads, by their content: a changed file is another trial."""

import contextlib
import hashlib
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from graspbench.errors import GraspbenchError
from graspbench.geometry import ObjectParameters
from graspbench.geometry.folders import pick_from_folder
from graspbench.geometry.reading import companions
from graspbench.hand import HandParameters
from graspbench.hand.files import SCHEME, find_urdf
from graspbench.simulation import SceneParameters
from graspbench.simulation.arm_parameters import FLOATING, ArmParameters

_MAX_FILES = 10_000
_CHUNK_BYTES = 1 << 20
_MAX_BYTES = 1 << 30
_MESH_REFERENCE = re.compile(r"""filename\s*=\s*["']([^"']+)["']""")


def file_digests(
    item: ObjectParameters,
    scene: SceneParameters,
    hand: HandParameters,
    tasks: Mapping[str, Mapping[str, Any]] | None = None,
    arm: ArmParameters = FLOATING,
) -> dict[str, str]:
    """Digest every file that a trial would read besides the configuration and the package's own.

    A file that is missing is left out: the trial itself says so.

    Args:
        item: The object, which may be a mesh file, one of a folder, or a catalogue entry of the user's.
        scene: The scene, which may be a folder of images, or have an image on the table.
        hand: The hand, which may be a URDF with meshes.
        tasks: Secondary tasks by name with their options; a ``file`` among these is read.
        arm: The arm, which may be a URDF with meshes.

    Returns:
        SHA-256 sums by what the file is for.
    """
    return {
        label: _digest(str(path), path.stat().st_mtime_ns, path.stat().st_size)
        for label, path in (
            *_object_files(item),
            *_scene_files(scene),
            *(_urdf_files("hand", hand) if hand.kind == "urdf" else ()),
            *_urdf_files("arm", arm),
            *_task_files(tasks or {}),
        )
        if _is_file(path)
    }


def _is_file(path: Path) -> bool:
    """Tell whether there is such a file; there is none whose name is too long to have one."""
    try:
        return path.is_file()
    except OSError:
        return False


def _object_files(item: ObjectParameters) -> Iterator[tuple[str, Path]]:
    if item.entry is not None:
        yield "object.entry", Path(item.entry).expanduser()
    if item.mesh is not None:
        yield from _mesh_files("object.mesh", Path(item.mesh).expanduser())
    if item.folder is not None:
        try:
            picked = pick_from_folder(Path(item.folder).expanduser(), item.id)
        except (GraspbenchError, OSError):
            return
        yield from _mesh_files("object.folder", picked.path)


def _mesh_files(label: str, path: Path) -> Iterator[tuple[str, Path]]:
    """Yield a mesh and the files that it names beside it."""
    yield label, path
    try:
        yield from ((f"{label}:{other.name}", other) for other in companions(path))
    except (GraspbenchError, OSError):
        return


def _scene_files(scene: SceneParameters) -> Iterator[tuple[str, Path]]:
    yield "scene.table", Path(scene.table).expanduser()
    if scene.source == "images" and scene.images_dir is not None:
        folder = Path(scene.images_dir).expanduser()
        with contextlib.suppress(OSError):  # whoever reads it next says so
            found = sorted(path for path in folder.rglob("*") if not path.name.startswith("."))
            for path in found[:_MAX_FILES]:
                yield f"scene.images_dir:{path.relative_to(folder).as_posix()}", path


def _urdf_files(section: str, robot: HandParameters | ArmParameters) -> Iterator[tuple[str, Path]]:
    """Yield the URDF of a hand or an arm, and the meshes that it names."""
    try:
        urdf, folders = find_urdf(robot.urdf, robot.package_dirs, robot.name)
        text = urdf.read_text(encoding="utf-8", errors="replace")
    except (GraspbenchError, OSError):
        return
    yield f"{section}.urdf", urdf
    for name in sorted(set(_MESH_REFERENCE.findall(text))):
        relative = name.removeprefix(SCHEME).removeprefix("file://")
        for folder in (urdf.parent, *folders):
            if _is_file(folder / relative):
                yield f"{section}.urdf:{name}", folder / relative
                break


def _task_files(tasks: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, Path]]:
    for name, options in tasks.items():
        if options.get("file") is not None:
            yield f"clik.tasks.{name}.file", Path(str(options["file"])).expanduser()


@lru_cache(maxsize=4096)
def _digest(path: str, _modified_ns: int, size: int) -> str:
    """Return a file's sum; one that has not changed since it was read is not read again.

    Only so much is read as the file says that it has: there are some without an end.
    """
    digest, left = hashlib.sha256(str(size).encode()), min(size, _MAX_BYTES)
    with contextlib.suppress(OSError), open(path, "rb") as stream:  # whoever reads it next says so
        while left > 0 and (chunk := stream.read(min(left, _CHUNK_BYTES))):
            digest.update(chunk)
            left -= len(chunk)
    return digest.hexdigest()
