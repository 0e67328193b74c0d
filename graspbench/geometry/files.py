"""Bodies from mesh files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from graspbench.geometry.body import Body
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.naming import file_label
from graspbench.geometry.preflight import prepare
from graspbench.geometry.reading import read_mesh
from graspbench.geometry.units import Scale

if TYPE_CHECKING:
    import trimesh


def load_mesh(path: str | Path, scale: Scale = 1.0) -> trimesh.Trimesh:
    """Return the mesh of a file as one closed surface, m.

    Args:
        path: A file that ends in .obj, .stl, .ply, .glb or .off.
        scale: Metres per unit of the file, or "guess".

    Raises:
        MeshError: The file cannot be read, or is no such surface; the sentence says why.
    """
    return load_body(Path(path), scale, repair=False).mesh


def load_body(path: Path, scale: Scale, repair: bool) -> Body:
    """Return a mesh file as a body in metres; arguments and errors as :func:`load_mesh`.

    Args:
        path: The file.
        scale: Metres per unit of the file, or "guess".
        repair: Whether to close holes, join bodies and drop stray ones instead of refusing the mesh.
    """
    try:
        stamp = path.stat()
    except OSError:
        return _load(path, scale, repair, 0, 0)
    return _load(path, scale, repair, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=32)
def _load(path: Path, scale: Scale, repair: bool, changed_ns: int, size: int) -> Body:
    """Load a file once per process, and again when it has changed."""
    del changed_ns, size  # they only tell the cache that it is another file
    vertices, faces = read_mesh(path)
    vertices, faces, report = prepare(vertices, faces, file_label(path), scale=scale, repaired=repair)
    if not report.usable:
        raise report.error()
    return Body(make_mesh(vertices, faces), None, report.repairs, report.warnings)
