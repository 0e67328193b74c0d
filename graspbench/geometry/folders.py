"""Folders of meshes: whole folders of the user's files, and YCB objects as they are distributed."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from graspbench.errors import MeshError
from graspbench.geometry.naming import distinct_names
from graspbench.geometry.reading import FORMATS
from graspbench.geometry.ycb import short_name

_YCB_VARIANTS = ("google_16k", "google_64k", "google_512k", "tsdf", "poisson")
_YCB_FILES = ("nontextured.ply", "nontextured.stl", "textured.obj")
_MAX_MESHES = 20_000


@dataclass(frozen=True)
class FolderItem:
    """One mesh of a folder.

    Attributes:
        name: What tells it apart from the others: the file's stem, or its folder's name where all files are
            called alike; the YCB object's name such as "003_cracker_box".
        path: The mesh file.
        ycb: Whether it is laid out as the YCB set distributes it (Calli et al. 2015).
    """

    name: str
    path: Path
    ycb: bool


def list_folder(folder: Path) -> tuple[FolderItem, ...]:
    """Return the meshes of a folder, sorted by name: YCB objects if there are any, else all mesh files.

    A folder without mesh files of its own is searched with its subfolders.

    Raises:
        MeshError: There is no such folder, or no mesh in it.
    """
    if not folder.is_dir():
        raise MeshError(f"there is no folder {folder}", remedy="check object.folder", kind="missing")
    own = [path for path in folder.iterdir() if _is_mesh(path)]
    items = (_ycb_objects(own) if folder.resolve().name in _YCB_VARIANTS else []) or _plain_items(own, folder)
    if not own:
        below = sorted(islice(_meshes_below(folder), _MAX_MESHES))
        items = _ycb_objects(below) or _plain_items(below, folder)
    if not items:
        raise MeshError(
            f"the folder {folder} holds no mesh",
            remedy=f"put .{', .'.join(FORMATS)} files there",
            kind="missing",
        )
    return tuple(sorted(items, key=lambda item: (item.name, str(item.path))))


def pick_from_folder(folder: Path, which: int | str | None) -> FolderItem:
    """Return one mesh of a folder.

    Args:
        folder: The folder.
        which: Number in the order of :func:`list_folder` from 0, or a name; that of an object of the YCB set
            may be given without its number. None for the first.

    Raises:
        MeshError: There is no such folder or mesh.
    """
    items = list_folder(folder)
    text = str(0 if which is None else which)
    for item in items:
        if text in (item.name, short_name(item.name)):
            return item
    if text.isdigit() and int(text) < len(items):
        return items[int(text)]
    known = ", ".join(item.name for item in items[:5]) + (", ..." if len(items) > 5 else "")
    raise MeshError(
        f"the folder {folder} has no mesh '{text}'",
        remedy=f"set object.id to 0 to {len(items) - 1} or a name ({known})",
        kind="missing",
    )


def _plain_items(meshes: list[Path], folder: Path) -> list[FolderItem]:
    names = distinct_names(meshes, folder)
    return [FolderItem(name, path, False) for name, path in zip(names, meshes, strict=True)]


def _ycb_objects(meshes: list[Path]) -> list[FolderItem]:
    """Pick the best mesh of each YCB object: <object>/<variant>/<file>."""
    best: dict[Path, tuple[int, int, Path]] = {}
    for path in meshes:
        variant, name = path.parent.resolve().name, path.name
        if variant in _YCB_VARIANTS and name in _YCB_FILES:
            rank = (_YCB_VARIANTS.index(variant), _YCB_FILES.index(name), path)
            owner = path.parent.resolve().parent
            best[owner] = min(best.get(owner, rank), rank)
    return [FolderItem(owner.name, path, True) for owner, (_, _, path) in best.items()]


def _meshes_below(folder: Path) -> Iterator[Path]:
    for inner, _, names in os.walk(folder):
        yield from (path for name in names if _is_mesh(path := Path(inner) / name))


def _is_mesh(path: Path) -> bool:
    return path.suffix.lower().lstrip(".") in FORMATS and path.is_file()
