"""Triangle meshes: making, moving and weighing them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    import trimesh
    from numpy.typing import ArrayLike


def make_mesh(vertices: ArrayLike, faces: ArrayLike) -> trimesh.Trimesh:
    """Return a mesh with exactly these vertices, shape (n, 3), and triangles, shape (m, 3)."""
    import trimesh  # here, because importing it takes longer than most uses of this package's data

    return trimesh.Trimesh(
        vertices=np.asarray(vertices, dtype=np.float64),
        faces=np.asarray(faces, dtype=np.int64),
        process=False,
        validate=False,
    )


def moved(mesh: trimesh.Trimesh, linear: FloatArray, offset: FloatArray | None = None) -> trimesh.Trimesh:
    """Return a copy of a mesh under x -> ``linear`` x + ``offset``.

    Args:
        mesh: The mesh.
        linear: Rotation times scale, shape (3, 3), positive determinant.
        offset: Translation, shape (3,), m; None for zero.
    """
    vertices = np.asarray(mesh.vertices) @ linear.T
    return make_mesh(vertices if offset is None else vertices + offset, mesh.faces)


def signed_volume(vertices: FloatArray, faces: IntArray) -> float:
    """Return the volume that a closed surface encloses; negative when its normals point inwards."""
    corners = vertices - vertices.mean(axis=0)  # near the origin there is less cancellation
    a, b, c = (corners[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def mass_properties(vertices: FloatArray, faces: IntArray) -> tuple[float, FloatArray, FloatArray]:
    """Return volume, centre of mass and inertia of a solid of density 1.

    The solid is summed from signed tetrahedra, whose second moments are closed forms (Tonon 2004).

    Args:
        vertices: Shape (n, 3), m.
        faces: Triangles of a closed surface with outward normals, shape (m, 3).

    Returns:
        Volume (m^3), centre of mass (3,) (m), and inertia about it (3, 3) (m^5).
    """
    origin = vertices.mean(axis=0)
    corners = (vertices - origin)[faces]
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    volume = float(volumes.sum())
    sums = corners.sum(axis=1)
    centre = volumes @ sums / (4.0 * volume)
    second = np.einsum("i,ij,ik->jk", volumes, sums, sums)
    second += np.einsum("i,ilj,ilk->jk", volumes, corners, corners)
    second = second / 20.0 - volume * np.outer(centre, centre)
    inertia = np.trace(second) * np.eye(3) - second
    return volume, centre + origin, inertia
