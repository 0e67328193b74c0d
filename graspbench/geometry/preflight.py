"""From any mesh file to a usable surface, or to one sentence that says why not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry.inspection import MeshProblem, MeshReport, inspect
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.reading import read_mesh
from graspbench.geometry.repair import repair
from graspbench.geometry.simplification import MAX_KEPT_TRIANGLES, simplify

if TYPE_CHECKING:
    import trimesh


def check_mesh(
    mesh: str | Path | trimesh.Trimesh, *, scale: float = 1.0, name: str | None = None
) -> MeshReport:
    """Inspect a mesh; nothing is raised for a bad one, and nothing is written.

    Args:
        mesh: A file, or a mesh.
        scale: Metres per unit of the mesh.
        name: What to call it; None for the file's name.
    """
    name = name or _name_of(mesh)
    try:
        vertices, faces = _arrays_of(mesh)
        return prepare(vertices * scale, faces, name, repaired=False)[2]
    except MeshError as error:
        problem = MeshProblem(
            str(error.data.get("kind", "broken")), error.what, error.remedy or "give another mesh"
        )
        return MeshReport(name, problems=(problem,))


def repair_mesh(
    mesh: str | Path | trimesh.Trimesh, *, scale: float = 1.0, name: str | None = None
) -> tuple[trimesh.Trimesh, MeshReport]:
    """Return a usable version of a mesh, and what was done to it.

    Holes are closed, walls that meet in one edge are taken apart, overlapping bodies are joined, cavities
    are filled and stray pieces dropped.

    Args:
        mesh: A file, or a mesh.
        scale: Metres per unit of the mesh.
        name: What to call it; None for the file's name.

    Returns:
        The mesh in metres, and its report, with every repair listed.

    Raises:
        MeshError: It cannot be read, or cannot be repaired (a handle, wrong units, no volume).
    """
    vertices, faces = _arrays_of(mesh)
    vertices, faces, report = prepare(vertices * scale, faces, name or _name_of(mesh), repaired=True)
    return make_mesh(vertices, faces), report


def prepare(
    vertices: FloatArray, faces: IntArray, name: str, *, repaired: bool
) -> tuple[FloatArray, IntArray, MeshReport]:
    """Clean and, if it is very fine, simplify a triangle set; repair it on request.

    Args:
        vertices: Shape (n, 3), m.
        faces: Shape (m, 3).
        name: What to call it in sentences.
        repaired: Whether to repair what is repairable; without it the report says what is wrong.

    Raises:
        MeshError: A repair was asked for and is not possible.
    """
    repairs: tuple[str, ...] = ()
    if len(faces) > MAX_KEPT_TRIANGLES:
        vertices, faces, report = inspect(vertices, faces, name, trusted=True)
        if report.usable:
            before = len(faces)
            vertices, faces, edge_m = simplify(vertices, faces)
            repairs = (
                *report.repairs,
                f"{before} triangles were simplified to {len(faces)} (edges of {1e3 * edge_m:.2g} mm)",
            )
        elif not repaired:
            return vertices, faces, report
    vertices, faces, report = (repair if repaired else inspect)(vertices, faces, name)
    return vertices, faces, replace(report, repairs=(*repairs, *report.repairs))


def _arrays_of(mesh: str | Path | trimesh.Trimesh) -> tuple[FloatArray, IntArray]:
    if isinstance(mesh, str | Path):
        return read_mesh(mesh)
    return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)


def _name_of(mesh: str | Path | trimesh.Trimesh) -> str:
    return Path(mesh).name if isinstance(mesh, str | Path) else "the mesh"
