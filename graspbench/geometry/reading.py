"""Mesh files: read them, or say in one sentence why not."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry.gltf_limits import check_glb
from graspbench.geometry.ply_format import read_ply
from graspbench.geometry.refusals import MAX_FILE_BYTES, MAX_TRIANGLES, broken, too_many_triangles
from graspbench.geometry.text_formats import read_text_mesh

FORMATS = ("obj", "stl", "ply", "glb", "off")

_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

_NO_MESHES = {
    b"version https://git-lfs": ("a pointer of Git LFS, not the mesh itself", "fetch it with git lfs pull"),
    b"<!doctype html": ("a web page, not a mesh", "download the file itself"),
    b"<html": ("a web page, not a mesh", "download the file itself"),
    b"pk\x03\x04": ("a zip archive, not a mesh", "unpack it"),
}
"""What stands in place of a mesh after a download that went wrong: what it is, and what to do."""


def read_mesh(path: str | Path) -> tuple[FloatArray, IntArray]:
    """Return the vertices, shape (n, 3), and triangles, shape (m, 3), of a mesh file in its own units.

    Polygons are triangulated, and the meshes of a scene are put together where the scene places them.

    Raises:
        MeshError: The file is missing, empty, too large, of another format, or broken.
    """
    file = Path(path).expanduser()
    suffix = _check_file(file, path)
    try:
        vertices, faces = _parse(file, suffix)
    except OSError as error:
        raise MeshError(
            f"{path} cannot be read ({error.strerror or error})",
            remedy="check its permissions",
            kind="missing",
            path=str(path),
        ) from None
    if len(faces) == 0:
        what = "points but no triangles" if len(vertices) else "no mesh"
        remedy = "make a surface of the points before" if len(vertices) else "export a triangle mesh"
        raise MeshError(f"{file.name} holds {what}", remedy=remedy, kind="empty", path=str(path))
    if len(faces) > MAX_TRIANGLES:
        raise too_many_triangles(file, len(faces))
    return vertices, faces


def companions(path: Path) -> tuple[Path, ...]:
    """Return the files beside a mesh file that it is read with: the buffers that a binary glTF names.

    Raises:
        MeshError: It names what is no plain file beside it, or is broken.
    """
    if path.suffix.lower() != ".glb" or not path.is_file():
        return ()
    return check_glb(path)


def _check_file(file: Path, path: str | Path) -> str:
    """Return the suffix of a file that is worth opening."""
    data = {"path": str(path)}
    if not file.exists():
        raise MeshError(f"there is no mesh file {path}", remedy="check the path", kind="missing", **data)
    if not file.is_file():
        raise MeshError(
            f"{path} is not a file",
            remedy="give a mesh file, or a folder as object.folder",
            kind="missing",
            **data,
        )
    suffix = file.suffix.lower().lstrip(".")
    if suffix not in FORMATS:
        raise MeshError(
            f"{file.name} is of no mesh format that can be read",
            remedy=f"give a file that ends in .{', .'.join(FORMATS)}",
            kind="format",
            **data,
        )
    size = file.stat().st_size
    if size == 0:
        raise MeshError(
            f"{file.name} is an empty file", remedy="copy or export it again", kind="empty", **data
        )
    if size > MAX_FILE_BYTES:
        raise MeshError(
            f"{file.name} has {size / 1e6:.0f} MB, more than the {MAX_FILE_BYTES / 1e6:.0f} MB that are read",
            remedy="simplify the mesh before",
            kind="too_large",
            **data,
        )
    return suffix


def _parse(file: Path, suffix: str) -> tuple[FloatArray, IntArray]:
    with file.open("rb") as stream:
        head = stream.read(4096)
    for start, (what, remedy) in _NO_MESHES.items():
        if head.lstrip()[: len(start)].lower() == start:
            raise MeshError(f"{file.name} is {what}", remedy=remedy, kind="broken", path=str(file))
    if suffix == "stl" and not _is_ascii_stl(file, head):
        return _read_binary_stl(file, head)
    if suffix in ("stl", "obj", "off"):
        return read_text_mesh(file, suffix, MAX_TRIANGLES)
    if suffix == "ply":
        return read_ply(file)
    check_glb(file)
    return _read_scene(file, suffix)


def _is_ascii_stl(file: Path, head: bytes) -> bool:
    """Whether an STL file is text; binary ones may begin with the word solid all the same."""
    text = head[2:] if head[:2] in (b"\xff\xfe", b"\xfe\xff") else head.removeprefix(b"\xef\xbb\xbf")
    if len(head) >= 84 and file.stat().st_size == 84 + 50 * _stl_count(head):
        return False
    begins = text.replace(b"\0", b"").lstrip()[:5].lower() == b"solid"
    return begins and (b"facet" in text.replace(b"\0", b"").lower() or b"endsolid" in text or len(head) < 84)


def _stl_count(head: bytes) -> int:
    return int(struct.unpack_from("<I", head, 80)[0])


def _read_binary_stl(file: Path, head: bytes) -> tuple[FloatArray, IntArray]:
    size = file.stat().st_size
    count = _stl_count(head) if len(head) >= 84 else 0
    if len(head) < 84 or count > (size - 84) // 50:
        there = max(0, (size - 84) // 50)
        raise broken(file, "stl", f"it is cut off or no STL: {there} of {count} triangles")
    if count > MAX_TRIANGLES:
        raise too_many_triangles(file, count)
    triangles = np.fromfile(file, dtype=_STL_TRIANGLE, count=count, offset=84)
    vertices = triangles["corners"].reshape(-1, 3).astype(np.float64)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _read_scene(file: Path, suffix: str) -> tuple[FloatArray, IntArray]:
    import trimesh

    try:
        with np.errstate(all="ignore"):
            loaded = trimesh.load_scene(file, file_type=suffix, process=False, skip_materials=True)
            pieces = [g for g in loaded.dump() if isinstance(g, trimesh.Trimesh)]
            points = sum(len(g.vertices) for g in loaded.geometry.values() if hasattr(g, "vertices"))
        vertices = [np.asarray(piece.vertices, dtype=np.float64).reshape(-1, 3) for piece in pieces]
        faces = [np.asarray(piece.faces, dtype=np.int64).reshape(-1, 3) for piece in pieces]
    except OSError:
        raise
    except (Exception, RecursionError):  # a parser may raise anything on a broken file
        raise broken(file, suffix) from None
    for corners, triangles in zip(vertices, faces, strict=True):
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(corners)):
            raise broken(file, suffix, "a triangle has a corner that does not exist")
    if not pieces:
        return np.zeros((points, 3)), np.zeros((0, 3), dtype=np.int64)
    offsets = np.cumsum([0, *[len(corners) for corners in vertices]])
    return np.concatenate(vertices), np.concatenate([f + o for f, o in zip(faces, offsets[:-1], strict=True)])
