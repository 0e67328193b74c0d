"""Objects from the user's mesh files and folders."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from graspbench.errors import MeshError
from graspbench.geometry.body import Body
from graspbench.geometry.inspection import inspect
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.reading import FORMATS, read_mesh
from graspbench.geometry.repair import repair as repair_arrays
from graspbench.geometry.simplification import MAX_KEPT_TRIANGLES, simplify

if TYPE_CHECKING:
    import trimesh


def load_mesh(path: str | Path, scale: float = 1.0) -> trimesh.Trimesh:
    """Return the mesh of a file as one closed surface of genus 0, m.

    Args:
        path: A file that ends in .obj, .stl, .ply, .glb or .off.
        scale: Metres per unit of the file.

    Raises:
        MeshError: The file cannot be read, or is no such surface; the sentence says why.
    """
    return load_body(Path(path), scale, repair=False).mesh


def load_body(path: Path, scale: float, repair: bool) -> Body:
    """Return a mesh file as a body in metres; arguments and errors as :func:`load_mesh`.

    Args:
        path: The file.
        scale: Metres per unit of the file.
        repair: Whether to close holes, join bodies and drop stray ones instead of refusing the mesh.
    """
    try:
        stamp = path.stat()
    except OSError:
        return _load(path, scale, repair, 0, 0)
    return _load(path, scale, repair, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=32)
def _load(path: Path, scale: float, repair: bool, changed_ns: int, size: int) -> Body:
    """Load a file once per process, and again when it has changed."""
    vertices, faces = read_mesh(path)
    vertices = vertices * scale
    repairs: tuple[str, ...] = ()
    if len(faces) > MAX_KEPT_TRIANGLES:
        before = len(faces)
        vertices, faces, report = inspect(vertices, faces, path.name, trusted=True)
        if report.usable:
            vertices, faces, collapsed_m = simplify(vertices, faces)
            repairs = (
                f"simplified from {before} to {len(faces)} triangles (edges of {1e3 * collapsed_m:.2g} mm)",
            )
    if repair:
        vertices, faces, report = repair_arrays(vertices, faces, path.name)
    else:
        vertices, faces, report = inspect(vertices, faces, path.name)
        if not report.usable:
            raise report.error()
    return Body(make_mesh(vertices, faces), None, (*repairs, *report.repairs), report.warnings)


def pick_from_folder(folder: Path, which: int | str | None) -> tuple[Path, str]:
    """Return the path and the name of one mesh of a folder.

    Args:
        folder: A folder of mesh files.
        which: Number in alphabetical order from 0, or file stem; None for the first.

    Raises:
        MeshError: There is no such folder or mesh.
    """
    if not folder.is_dir():
        raise MeshError(f"there is no folder {folder}", remedy="check object.folder")
    meshes = sorted(path for path in folder.iterdir() if path.suffix.lower().lstrip(".") in FORMATS)
    if not meshes:
        raise MeshError(
            f"the folder {folder} holds no mesh", remedy=f"put .{', .'.join(FORMATS)} files there"
        )
    path = meshes[int(which or 0)]
    return path, path.stem
