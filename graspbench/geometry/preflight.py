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
from graspbench.geometry.naming import file_label
from graspbench.geometry.reading import read_mesh
from graspbench.geometry.repair import repair
from graspbench.geometry.simplification import MAX_KEPT_TRIANGLES, simplify
from graspbench.geometry.units import Scale, to_metres
from graspbench.geometry.wrinkles import tolerate_wrinkles

if TYPE_CHECKING:
    import trimesh


def check_mesh(
    mesh: str | Path | trimesh.Trimesh, *, scale: Scale = 1.0, name: str | None = None
) -> MeshReport:
    """Inspect a mesh; nothing is raised for a bad one, and nothing is written.

    Args:
        mesh: A file, or a mesh.
        scale: Metres per unit of the mesh, or "guess".
        name: What to call it; None for the file's name.
    """
    name = name or _name_of(mesh)
    try:
        return prepare(*_arrays_of(mesh), name, scale=scale, repaired=False)[2]
    except MeshError as error:
        problem = MeshProblem(
            str(error.data.get("kind", "broken")), error.what, error.remedy or "give another mesh"
        )
        return MeshReport(name, problems=(problem,))


def repair_mesh(
    mesh: str | Path | trimesh.Trimesh, *, scale: Scale = 1.0, name: str | None = None
) -> tuple[trimesh.Trimesh, MeshReport]:
    """Return a usable version of a mesh, and what was done to it.

    Holes are closed, walls that meet in one edge are taken apart, overlapping bodies are joined, cavities
    are filled and stray pieces dropped.

    Args:
        mesh: A file, or a mesh.
        scale: Metres per unit of the mesh, or "guess".
        name: What to call it; None for the file's name.

    Returns:
        The mesh in metres, and its report, with every repair listed.

    Raises:
        MeshError: It cannot be read, or cannot be repaired (a handle, wrong units, no volume).
    """
    vertices, faces, report = prepare(*_arrays_of(mesh), name or _name_of(mesh), scale=scale, repaired=True)
    return make_mesh(vertices, faces), report


def prepare(
    vertices: FloatArray, faces: IntArray, name: str, *, scale: Scale, repaired: bool
) -> tuple[FloatArray, IntArray, MeshReport]:
    """Clean and, if it is very fine, simplify a triangle set; repair it on request.

    Args:
        vertices: Shape (n, 3), in units of the mesh.
        faces: Shape (m, 3).
        name: What to call it in sentences.
        scale: Metres per unit, or "guess".
        repaired: Whether to repair what is repairable; without it the report says what is wrong.

    Returns:
        Vertices in metres, triangles, and the report.

    Raises:
        MeshError: A unit cannot be guessed, or a repair was asked for and is not possible.
    """
    vertices, warnings = to_metres(vertices, scale, name)
    is_fine = len(faces) > MAX_KEPT_TRIANGLES
    treat = repair if repaired else inspect
    vertices, faces, report = treat(vertices, faces, name, trusted=is_fine)
    if is_fine and report.usable:
        vertices, faces, report = _simplified(vertices, faces, report)
        if repaired and not (report := tolerate_wrinkles(report)).usable:
            raise report.error()
    return vertices, faces, replace(report, warnings=(*warnings, *report.warnings))


def _simplified(
    vertices: FloatArray, faces: IntArray, before: MeshReport
) -> tuple[FloatArray, IntArray, MeshReport]:
    """Simplify a usable surface and look for the self-intersections that cost too much before."""
    vertices, simple, edge_m = simplify(vertices, faces)
    if len(simple) > 10 * MAX_KEPT_TRIANGLES:
        return vertices, faces, replace(before, usable=False, problems=(_too_rough(before),))
    repairs = before.repairs
    if len(simple) < len(faces):
        done = f"{len(faces)} triangles were simplified to {len(simple)} (edges of {1e3 * edge_m:.2g} mm)"
        repairs = (*repairs, done)
    vertices, simple, after = inspect(vertices, simple, before.name)
    report = replace(after, repairs=(*repairs, *after.repairs), warnings=before.warnings)
    if any(problem.kind != "self_intersecting" for problem in report.problems):
        report = replace(report, problems=(_too_rough(before),))
    return vertices, simple, report


def _too_rough(report: MeshReport) -> MeshProblem:
    what = f"{report.name} has {report.triangles} triangles, and is too rough to be simplified"
    return MeshProblem("too_fine", what, "smooth or remesh it")


def _arrays_of(mesh: str | Path | trimesh.Trimesh) -> tuple[FloatArray, IntArray]:
    if isinstance(mesh, str | Path):
        return read_mesh(mesh)
    return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)


def _name_of(mesh: str | Path | trimesh.Trimesh) -> str:
    return file_label(Path(mesh)) if isinstance(mesh, str | Path) else "the mesh"
