"""Whether a binary glTF may be handed to its parser: what it announces is bounded, what it names its own.

The parser allocates what the file's JSON announces, whether or not there is data for it, repeats a mesh for
every node that shows it, and opens whatever file a buffer names.
"""

from __future__ import annotations

import json
import stat
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from graspbench.errors import MeshError
from graspbench.geometry.refusals import (
    MAX_FILE_BYTES,
    MAX_TRIANGLES,
    MAX_VERTICES,
    announced,
    broken,
    too_large,
)

_MAX_JSON_BYTES = 30_000_000
_MAX_NODES = 10_000
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def check_glb(file: Path) -> tuple[Path, ...]:
    """Refuse a binary glTF that would take more memory or other files than a mesh may.

    Returns:
        The files that its buffers name.

    Raises:
        MeshError: It is no glTF, announces or repeats too much, or names a file that is not beside it.
    """
    content = _content(file)
    try:
        _check_accessors(file, content)
        _check_primitives(file, content)
        _check_nodes(file, content)
        for image in _list(content, "images"):
            _named_file(file, image.get("uri"))
        named = [_named_file(file, buffer.get("uri")) for buffer in _list(content, "buffers")]
        return tuple(other for other in named if other is not None)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, RecursionError):
        raise broken(file, "glb") from None


def _content(file: Path) -> dict[str, Any]:
    with file.open("rb") as stream:
        header = stream.read(20)
        if len(header) < 20 or header[:4] != b"glTF":
            raise broken(file, "glb", "it does not begin with glTF")
        length = struct.unpack_from("<I", header, 12)[0]
        if length > _MAX_JSON_BYTES:
            raise too_large(
                file, f"{length / 1e6:.0f} MB of JSON, more than the {_MAX_JSON_BYTES / 1e6:.0f} MB read"
            )
        text = stream.read(length)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise broken(file, "glb") from None
    if not isinstance(content, dict):
        raise broken(file, "glb")
    return content


def _list(content: dict[str, Any], key: str) -> list[Any]:
    found = content.get(key, [])
    if not isinstance(found, list):
        raise TypeError(key)
    return found


def _check_accessors(file: Path, content: dict[str, Any]) -> None:
    """An accessor is an array, of zeros where it names no data."""
    total = 0
    for accessor in _list(content, "accessors"):
        count = int(accessor["count"])
        sparse = int(accessor.get("sparse", {}).get("count", 0))
        if not (0 <= count <= MAX_VERTICES and 0 <= sparse <= MAX_VERTICES):
            raise announced(file, max(count, sparse))
        total += 8 * count * _COMPONENTS.get(accessor.get("type"), 16)
        if total > MAX_FILE_BYTES:
            raise too_large(file, f"arrays of more than {MAX_FILE_BYTES / 1e6:.0f} MB in all")


def _check_primitives(file: Path, content: dict[str, Any]) -> None:
    """Count what the scene shows: a mesh may be shown by many nodes, and many primitives share an array."""
    lengths = [int(accessor["count"]) for accessor in _list(content, "accessors")]
    of_mesh = []
    for mesh in _list(content, "meshes"):
        total = 0
        for primitive in mesh["primitives"]:
            named = [
                *primitive["attributes"].values(),
                *([primitive["indices"]] if "indices" in primitive else []),
            ]
            total += max((lengths[int(k)] for k in named), default=0)
        of_mesh.append(total)
    shown = [of_mesh[int(node["mesh"])] for node in _list(content, "nodes") if "mesh" in node]
    if (count := max(sum(of_mesh), sum(shown))) > 3 * MAX_TRIANGLES:
        raise announced(file, count)
    if max(len(of_mesh), sum(len(mesh["primitives"]) for mesh in _list(content, "meshes"))) > _MAX_NODES:
        raise too_large(file, f"more than {_MAX_NODES} pieces")


def _check_nodes(file: Path, content: dict[str, Any]) -> None:
    """Nodes are trees: none has two parents, so that the scene is not larger than the file."""
    nodes = _list(content, "nodes")
    if len(nodes) > _MAX_NODES:
        raise too_large(file, f"{len(nodes)} nodes, more than the {_MAX_NODES} that are read")
    children = [int(child) for node in nodes for child in node.get("children", [])]
    roots = {int(node) for scene in _list(content, "scenes") for node in scene.get("nodes", [])}
    if len(set(children)) < len(children) or roots & set(children):
        raise broken(file, "glb", "a node of its scene has two parents")
    seen = sum(1 for _ in _reached(nodes, sorted(roots)))
    if seen > len(nodes):
        raise broken(file, "glb", "a node of its scene has two parents")


def _reached(nodes: list[Any], roots: list[int]) -> Iterator[int]:
    stack = list(roots)
    while stack:
        yield (node := stack.pop())
        stack += [int(child) for child in nodes[node].get("children", [])]


def _named_file(file: Path, uri: Any) -> Path | None:
    """Return the file that is named; an error if it is not a plain one in the mesh's own folder."""
    if uri is None or str(uri).startswith("data:"):
        return None
    name = unquote(str(uri))
    other = file.parent / name
    try:
        own = "\0" not in name and other.resolve().parent == file.parent.resolve()
        plain = own and stat.S_ISREG(other.stat().st_mode) and other.stat().st_size <= MAX_FILE_BYTES
    except OSError:
        plain = False
    if not plain:
        raise MeshError(
            f"{file.name} names the file '{name[:60]}', which is no plain file beside it",
            remedy="export it with everything in one file",
            kind="broken",
            path=str(file),
        )
    return other
