"""Convex pieces of a mesh, for contact dynamics.

A body is cut by axis-parallel planes, always the piece that wastes most volume between itself and its
convex hull, always where the two halves waste least, also where one cut alone does not help yet: half a ring
fills as much of its hole as the whole one, a quarter less. So cavities and holes stay open. Cuts are exact
(manifold3d) and nothing is drawn at random, so that a mesh has one decomposition. A fixed budget of pieces
bounds the time.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry.convex_union import from_manifold, to_manifold
from graspbench.geometry.mesh import make_mesh, signed_volume

if TYPE_CHECKING:
    import trimesh

MAX_PARTS = 40
"""More pieces than this slow contact dynamics down without moving a contact by a noticeable distance."""

_WASTE_SHARE = 0.01
"""The pieces may enclose this share of volume more than the body."""

_COARSE, _FINE = (0.1, 0.3, 0.5, 0.7, 0.9), (-0.1, -0.05, 0.05, 0.1)
"""Where cuts are tried, as shares of a piece's extent, and then beside the best of them."""

_SLIVER_SHARE = 1e-6
_SMOOTHING_M = 5e-4
_ALGORITHM = "axis cuts 2"
"""Part of a cached decomposition's name: change it with the algorithm."""


@dataclass(frozen=True)
class _Piece:
    solid: Any
    hull: Any
    waste: float


def convex_parts(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, ...]:
    """Return convex meshes whose union is a closed mesh up to a percent of its volume, m.

    Args:
        mesh: One closed surface without self-intersections.
    """
    vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
    if (hull := _hull_if_convex(vertices, faces)) is not None:
        return (from_manifold(hull),)
    digest = hashlib.sha256(f"{_ALGORITHM} {MAX_PARTS} {_WASTE_SHARE}".encode())
    digest.update(vertices.tobytes())
    digest.update(faces.tobytes())
    file = _cache_folder() / f"{digest.hexdigest()[:32]}.npz"
    parts = _read(file)
    if parts is None:
        parts = tuple(from_manifold(hull) for hull in _hulls(vertices, faces))
        _write(file, parts)
    return parts


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "graspbench" / "convex_parts"


def _read(file: Path) -> tuple[trimesh.Trimesh, ...] | None:
    try:
        with file.open("rb") as stream, np.load(stream) as arrays:
            return tuple(
                make_mesh(arrays[f"vertices_{i}"], arrays[f"faces_{i}"])
                for i in range(len(arrays.files) // 2)
            )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):  # absent, or left half-written
        return None


def _write(file: Path, parts: tuple[trimesh.Trimesh, ...]) -> None:
    arrays = {f"vertices_{i}": part.vertices for i, part in enumerate(parts)}
    arrays |= {f"faces_{i}": part.faces for i, part in enumerate(parts)}
    scratch = file.with_suffix(f".{os.getpid()}.npz")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(scratch, **arrays)
        scratch.replace(file)  # in one step: another process may read it meanwhile
    except OSError:  # a cache that cannot be written is no reason to fail
        with contextlib.suppress(OSError):
            scratch.unlink(missing_ok=True)


def _hull_if_convex(vertices: FloatArray, faces: IntArray) -> Any | None:
    import manifold3d

    hull = manifold3d.Manifold.hull_points(vertices)
    return hull if hull.volume() - signed_volume(vertices, faces) < _WASTE_SHARE * hull.volume() else None


def _hulls(vertices: FloatArray, faces: IntArray) -> list[Any]:
    import manifold3d

    solid = to_manifold(vertices, faces)
    if solid.is_empty():
        return [manifold3d.Manifold.hull_points(vertices)]
    allowed = _WASTE_SHARE * solid.volume()
    pieces = [_piece(solid.simplify(_SMOOTHING_M))]
    while len(pieces) < MAX_PARTS and sum(piece.waste for piece in pieces) > allowed:
        worst = max(range(len(pieces)), key=lambda i: pieces[i].waste)
        halves = _best_cut(pieces[worst])
        if not halves:
            break
        pieces[worst : worst + 1] = halves
    return [piece.hull for piece in pieces]


def _piece(solid: Any) -> _Piece:
    hull = solid.hull()
    return _Piece(solid, hull, hull.volume() - solid.volume())


def _best_cut(piece: _Piece) -> list[_Piece]:
    """Return the halves of the best cut; of cuts that waste alike, the one with the more even halves."""
    low, high = np.reshape(piece.solid.bounding_box(), (2, 3))
    axes = [axis for axis in range(3) if high[axis] - low[axis] > 0.2 * float((high - low).max())]
    tried = [(axis, share) for axis in axes for share in _COARSE]
    cuts = {key: _halves(piece, low, high, *key) for key in tried}
    axis, share = min(tried, key=lambda key: _badness(cuts[key]))
    finer = [(axis, share + step) for step in _FINE if 0.0 < share + step < 1.0]
    cuts |= {key: _halves(piece, low, high, *key) for key in finer}
    best = min(cuts.values(), key=_badness)
    return best if _badness(best) < np.inf else []


def _halves(piece: _Piece, low: FloatArray, high: FloatArray, axis: int, share: float) -> list[_Piece]:
    normal = [0.0, 0.0, 0.0]
    normal[axis] = 1.0
    sides = piece.solid.split_by_plane(normal, float(low[axis] + share * (high[axis] - low[axis])))
    return [
        half
        for side in sides
        for part in side.decompose()
        if (half := _piece(part)).hull.volume() > _SLIVER_SHARE * piece.hull.volume()
    ]


def _badness(halves: list[_Piece]) -> float:
    if len(halves) < 2:
        return float(np.inf)
    wastes = [half.waste for half in halves]
    return float(sum(wastes) + 0.1 * max(wastes))
