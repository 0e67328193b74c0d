"""What the object in a mesh file is called: names that tell one object's file from another's."""

from collections import Counter
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

_SAYS_NOTHING = frozenset(
    [
        *("textured", "textured_simple", "textured_vhacd", "nontextured", "nontextured_simplified"),
        *("google_16k", "google_64k", "google_512k", "tsdf", "poisson"),
        *("mesh", "meshes", "model", "models", "model_normalized", "model_watertight", "object", "scan"),
        *("base", "base_link", "visual", "visuals", "collision", "collisions", "surface"),
        *("coarse", "fine", "raw", "simplified", "decimated", "decomposed", "merged"),
        *("untitled", "unnamed", "output", "out", "result", "final", "stl", "obj", "ply", "off", "glb"),
    ]
)
"""Names of files and folders, in lower case, that say how a mesh was made and not what it is of."""

_MAX_SIBLINGS = 2_000


def mesh_name(path: Path) -> str:
    """Return what to call the object in a mesh file.

    That is the file's stem, or where every object of a collection has this stem the name of the next folder
    above that says what the object is (``mug/textured.obj``). Where the folder's neighbours hold a file of
    that name too, it is both (``small/cup.stl`` and ``large/cup.stl``).
    """
    path = path.absolute()
    name = _own_name(path)
    if name == path.stem and path.parent.name and _is_shared(path):
        return f"{path.parent.name}_{name}"
    return name


def file_label(path: Path) -> str:
    """Return how sentences call a mesh file: its name, if need be after the folder that says what it is."""
    path = path.absolute()
    for folder in path.parents:
        if folder.name == _own_name(path) != path.stem:
            return path.relative_to(folder.parent).as_posix()
    return path.name


def distinct_names(paths: Sequence[Path], folder: Path) -> list[str]:
    """Return a name for each mesh file of a folder, no two alike.

    Where the names alone are alike, the folders between stand before them, then the suffix behind.

    Args:
        paths: Files in or below the folder.
        folder: What the names need not repeat.
    """

    def with_folders(path: Path) -> str:
        parts = path.relative_to(folder).with_suffix("").parts
        return "_".join([part for part in parts if _says_something(part)] or parts)

    def with_all(path: Path) -> str:
        return "_".join(path.relative_to(folder).with_suffix("").parts)

    def with_suffix(path: Path) -> str:
        return f"{with_all(path)}_{path.suffix.lower().lstrip('.')}"

    def with_number(path: Path) -> str:
        return f"{with_suffix(path)}_{paths.index(path)}"

    names = [_own_name(path.absolute()) for path in paths]
    for longer in (with_folders, with_all, with_suffix, with_number):
        often = Counter(names)
        names = [longer(path) if often[name] > 1 else name for name, path in zip(names, paths, strict=True)]
    return names


def _own_name(path: Path) -> str:
    for name in (path.stem, *(folder.name for folder in path.parents)):
        if _says_something(name):
            return name
    return path.stem


def _says_something(name: str) -> bool:
    return bool(name) and name.lower() not in _SAYS_NOTHING


def _is_shared(path: Path) -> bool:
    """Whether a folder beside the file's own holds a file of the same name."""
    try:
        siblings = islice(path.parent.parent.iterdir(), _MAX_SIBLINGS)
        return any(
            (folder / path.name).is_file() and not folder.samefile(path.parent)  # nor a link to it
            for folder in siblings
        )
    except OSError:  # what may not be looked at tells nothing
        return False
