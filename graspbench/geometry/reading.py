"""Mesh files: read them, or say in one sentence why not."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError

FORMATS = ("obj", "stl", "ply", "glb", "off")

MAX_FILE_BYTES = 400_000_000
MAX_TRIANGLES = 3_000_000
"""More than any scan of a graspable object needs; reading stays below 2 GB of memory."""


def read_mesh(path: str | Path) -> tuple[FloatArray, IntArray]:
    """Return the vertices, shape (n, 3), and triangles, shape (m, 3), of a mesh file in its own units.

    Polygons are triangulated, and the meshes of a scene are put together where the scene places them.

    Raises:
        MeshError: The file is missing, empty, too large, of another format, or broken.
    """
    file = Path(path).expanduser()
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
        raise MeshError(f"{file.name} is an empty file", kind="empty", **data)
    if size > MAX_FILE_BYTES:
        raise MeshError(
            f"{file.name} has {size / 1e6:.0f} MB, more than the {MAX_FILE_BYTES / 1e6:.0f} MB that are read",
            remedy="simplify the mesh before",
            kind="too_large",
            **data,
        )
    if (announced := _announced_triangles(file, suffix)) > MAX_TRIANGLES:
        raise _too_many(file, announced)
    vertices, faces = _parse(file, suffix)
    if len(faces) == 0:
        what = "no triangles" if len(vertices) else "no mesh"
        raise MeshError(f"{file.name} holds {what}", remedy="export a triangle mesh", kind="empty", **data)
    if len(faces) > MAX_TRIANGLES:
        raise _too_many(file, len(faces))
    return vertices, faces


def _parse(file: Path, suffix: str) -> tuple[FloatArray, IntArray]:
    import trimesh

    try:
        with np.errstate(all="ignore"):
            loaded = trimesh.load_scene(file, file_type=suffix, process=False, skip_materials=True)
            pieces = [g for g in loaded.dump() if isinstance(g, trimesh.Trimesh)]
        vertices = [np.asarray(piece.vertices, dtype=np.float64).reshape(-1, 3) for piece in pieces]
        faces = [np.asarray(piece.faces, dtype=np.int64).reshape(-1, 3) for piece in pieces]
        for points, triangles in zip(vertices, faces, strict=True):
            if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
                raise MeshError(
                    f"{file.name} has triangles with corners that do not exist", kind="broken", path=str(file)
                )
    except MeshError:
        raise
    except (Exception, RecursionError) as error:  # a parser may raise anything on a broken file
        raise MeshError(
            f"{file.name} cannot be read as .{suffix}{_detail(error)}",
            remedy="export it again, or check that it is a mesh",
            kind="broken",
            path=str(file),
        ) from None
    offsets = np.cumsum([0, *[len(points) for points in vertices]])
    return (
        np.concatenate([np.zeros((0, 3)), *vertices]),
        np.concatenate(
            [np.zeros((0, 3), dtype=np.int64), *(f + o for f, o in zip(faces, offsets, strict=False))]
        ),
    )


def _announced_triangles(file: Path, suffix: str) -> int:
    """Return how many triangles a file's header announces, 0 when it does not say."""
    with file.open("rb") as stream:
        head = stream.read(4096)
    if suffix == "stl" and not head.lstrip().startswith(b"solid") and len(head) >= 84:
        count = int(struct.unpack_from("<I", head, 80)[0])
        if count <= MAX_TRIANGLES and file.stat().st_size < 84 + 50 * count:
            raise MeshError(
                f"{file.name} cannot be read as .stl (it is cut off before its {count} triangles end)",
                remedy="copy or export it again",
                kind="broken",
                path=str(file),
            )
        return count
    if suffix == "ply":
        for line in head.split(b"\n"):
            words = line.split()
            if words[:2] == [b"element", b"face"] and words[2:] and words[2].isdigit():
                return int(words[2])
    return 0


def _too_many(file: Path, count: int) -> MeshError:
    return MeshError(
        f"{file.name} has {count} triangles, more than the {MAX_TRIANGLES} that are read",
        remedy="simplify the mesh before",
        kind="too_large",
        path=str(file),
        triangles=count,
    )


def _detail(error: BaseException) -> str:
    """Return what a parser said, cut to a short clause."""
    said = " ".join(str(error).split()).rstrip(".")
    return f" ({said[:80]})" if said else ""
