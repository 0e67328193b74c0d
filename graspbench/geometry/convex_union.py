"""One closed body from several overlapping convex parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry import topology
from graspbench.geometry.body import Body
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.spurious import without_spurious_handles

if TYPE_CHECKING:
    import trimesh

_WELD_M = 1e-5
"""Edges shorter than this are collapsed: intersections leave slivers that no camera or finger can see."""

_DIRECTIONS = 700
_HULL_TOLERANCE_M = 2e-4


def read_obj_parts(path: Path) -> list[FloatArray]:
    """Return the vertices of each object in a Wavefront file, one array (n, 3) a part.

    Raises:
        MeshError: The file is missing or holds something else.
    """
    vertices: list[list[float]] = []
    parts: list[set[int]] = []
    try:
        with path.open() as lines:
            for line in lines:
                match line.split():
                    case ["v", x, y, z, *_]:
                        vertices.append([float(x), float(y), float(z)])
                    case ["o" | "g", *_]:
                        parts.append(set())
                    case ["f", *corners]:
                        parts[-1].update(int(corner.split("/")[0]) - 1 for corner in corners)
        points = np.array(vertices, dtype=np.float64)
        return [points[sorted(part)] for part in parts if part]
    except FileNotFoundError:
        raise MeshError(f"there is no mesh file {path}", remedy="check the path", path=str(path)) from None
    except (ValueError, IndexError, UnicodeDecodeError) as error:
        raise MeshError(
            f"{path.name} is not a Wavefront file of convex parts ({error})", path=str(path)
        ) from None


def unite_convex_parts(parts: Sequence[FloatArray], inflate_m: Sequence[float], name: str) -> Body:
    """Return the union of the convex hulls of some point sets, each grown a little.

    Parts that were cut from one body share faces without overlapping, so that their plain union falls
    apart or is riddled with slits; growing each by a fraction of a millimetre joins them.

    Args:
        parts: Vertices of each part, shapes (n_i, 3), m.
        inflate_m: How far each part's vertices move out along their normals, m; the next value is tried
            when the parts do not form one body with the one before.
        name: What to call the object in errors.

    Raises:
        MeshError: The parts stay apart.
    """
    first: MeshError | None = None
    best: Body | None = None
    for distance in inflate_m:
        try:
            body = _unite(parts, distance, name)
        except MeshError as error:
            first = first or error
            continue
        if first is not None or best is not None:
            grown = f"the convex parts were grown by {1e3 * distance:g} mm to join them"
            body = replace(body, repairs=(grown, *body.repairs))
        # Slits between the parts look like holes through the object: growing closes them.
        if best is None or _genus(body) < _genus(best):
            best = body
        if _genus(best) == 0:
            break
    if best is None:
        raise first or MeshError(f"{name} has no convex parts", object=name)
    return best if _genus(best) == 0 else _without_slits(best, name)


def _without_slits(body: Body, name: str) -> Body:
    """Close what slits between the parts are left; the parts stay as they are."""
    done: list[str] = []
    vertices, faces = np.asarray(body.mesh.vertices), np.asarray(body.mesh.faces)
    vertices, faces = without_spurious_handles(vertices, faces, name, done)
    return replace(body, mesh=make_mesh(vertices, faces), repairs=(*body.repairs, *done)) if done else body


def _genus(body: Body) -> int:
    return topology.genus(len(body.mesh.vertices), len(body.mesh.faces))


def _unite(parts: Sequence[FloatArray], inflate_m: float, name: str) -> Body:
    import manifold3d

    grown = [_grown_hull(points, inflate_m) for points in parts]
    hulls = [hull for hull in grown if not hull.is_empty()]
    repairs = []
    if len(hulls) < len(parts):
        repairs.append(f"{len(parts) - len(hulls)} flat parts were left out")
    if not hulls:
        raise MeshError(
            f"{name} has no part that encloses a volume",
            remedy="choose another object",
            kind="flat",
            object=name,
        )
    union = manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add).simplify(_WELD_M)
    shells = union.decompose()
    bodies = [shell for shell in shells if shell.volume() > 0.0]
    if len(bodies) > 1:
        raise MeshError(
            f"the {len(hulls)} convex parts of {name} form {len(bodies)} separate bodies",
            remedy="choose another object",
            kind="bodies",
            object=name,
            bodies=len(bodies),
        )
    if len(shells) > 1:
        repairs.append(f"{len(shells) - 1} cavities were filled")
    return Body(from_manifold(bodies[0]), tuple(from_manifold(hull) for hull in hulls), tuple(repairs))


def hull_mesh(points: FloatArray) -> trimesh.Trimesh:
    """Return the convex hull of points, shape (n, 3), without the vertices that hardly matter.

    Contact dynamics visits every vertex of a convex part in every step. So extreme points in evenly spread
    directions are taken first, and then those that are left outside by more than two tenths of a millimetre.

    Raises:
        MeshError: The points lie in one plane.
    """
    import manifold3d

    kept = np.arange(len(points))
    if len(points) > _DIRECTIONS:
        kept = np.unique(np.argmax(_spread_directions(_DIRECTIONS) @ points.T, axis=1))
    while True:
        hull = manifold3d.Manifold.hull_points(points[kept])
        if hull.is_empty():
            raise MeshError("the points of a convex part lie in one plane")
        if len(kept) == len(points):
            return from_manifold(hull)
        normals, offsets = _face_planes(*manifold_arrays(hull))
        above = normals @ points.T - offsets[:, None]
        furthest = np.argmax(above, axis=1)
        outside = furthest[above[np.arange(len(offsets)), furthest] > _HULL_TOLERANCE_M]
        if len(outside) == 0:
            return from_manifold(hull)
        kept = np.union1d(kept, outside)


def from_manifold(manifold: Any) -> trimesh.Trimesh:
    """Return a manifold3d body as a mesh."""
    vertices, faces = manifold_arrays(manifold)
    return make_mesh(vertices, faces)


def to_manifold(vertices: FloatArray, faces: IntArray) -> Any:
    """Return a closed mesh as a manifold3d body; it is empty when the mesh is not a manifold."""
    import manifold3d

    return manifold3d.Manifold(
        manifold3d.Mesh64(
            # Copies, because it takes no array that is read-only.
            np.array(vertices, dtype=np.float64, order="C"),
            np.array(faces, dtype=np.uint64, order="C"),
        )
    )


def manifold_arrays(manifold: Any) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) and triangles (m, 3) of a manifold3d body."""
    mesh = manifold.to_mesh64()
    return (
        np.array(mesh.vert_properties, dtype=np.float64)[:, :3],
        np.array(mesh.tri_verts, dtype=np.int64),
    )


def _spread_directions(count: int) -> FloatArray:
    """Return unit vectors on a Fibonacci lattice, shape (count, 3)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * index
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def _grown_hull(points: FloatArray, distance_m: float) -> Any:
    import manifold3d

    hull = manifold3d.Manifold.hull_points(points)
    if hull.is_empty() or distance_m == 0.0:
        return hull
    vertices, faces = manifold_arrays(hull)
    return manifold3d.Manifold.hull_points(vertices + distance_m * _vertex_normals(vertices, faces))


def _face_planes(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return normals, np.einsum("ij,ij->i", normals, a)


def _vertex_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    normals, _ = _face_planes(vertices, faces)
    sums = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(sums, faces[:, corner], normals)
    unit: FloatArray = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return unit
