"""Make a usable body of a mesh that is open, torn, or in pieces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry import topology
from graspbench.geometry.convex_union import manifold_arrays, to_manifold
from graspbench.geometry.gaps import close_holes
from graspbench.geometry.inspection import MeshReport, counted, inspect
from graspbench.geometry.mesh import signed_volume
from graspbench.geometry.spurious import without_spurious_handles
from graspbench.geometry.wrinkles import smoothed, tolerate_wrinkles

_RIVAL_SHARE = 0.25
"""A second body of this share of the first one's volume is no stray piece: which one is meant?"""

_STRAY_SHARE = 0.02
"""A piece of more than this share of the body's volume is not dropped without a warning."""

_WIDE_SHARE = 0.3
"""A hole of this share of the body's size is no gap of a scan: what closes it is a guess."""

_MAX_PIECES = 2000


def repair(
    vertices: FloatArray, faces: IntArray, name: str, *, trusted: bool = False
) -> tuple[FloatArray, IntArray, MeshReport]:
    """Close, join and sort out a triangle set in metres, as :func:`graspbench.geometry.repair_mesh` says.

    Args:
        vertices: Shape (n, 3), m.
        faces: Shape (m, 3).
        name: What to call it in sentences.
        trusted: Do not look for self-intersections.
    """
    done: list[str] = []
    broken = ~np.all(np.isfinite(vertices), axis=1)
    if np.any(lost := broken[faces].any(axis=1)):
        done.append(f"{counted(int(lost.sum()), 'triangle')} dropped whose corners are not finite")
        vertices, faces = np.where(broken[:, None], 0.0, vertices), faces[~lost]
    vertices, faces, report = inspect(vertices, faces, name, trusted=True)
    done += report.repairs
    beyond = [problem for problem in report.problems if not problem.repairable]
    if beyond:
        raise replace(report, problems=tuple(beyond)).error()
    warnings: list[str] = []
    if not report.usable:
        solids = _closed_bodies(vertices, faces, name, done, warnings)
        vertices, faces = _one_body(solids, name, done, warnings)
        vertices, faces = without_spurious_handles(vertices, faces, name, done)
        vertices, faces, report = inspect(vertices, faces, name, trusted=True)
    if report.usable and not trusted:
        vertices, report = smoothed(vertices, faces, report)
    report = tolerate_wrinkles(
        replace(
            report,
            repairs=(*done, *(r for r in report.repairs if r not in done)),
            warnings=(*report.warnings, *warnings),
        )
    )
    if not report.usable:
        raise report.error()
    return vertices, faces, report


def _closed_bodies(
    vertices: FloatArray, faces: IntArray, name: str, done: list[str], warnings: list[str]
) -> list[Any]:
    """Take the mesh apart into bodies, close each, and return those that enclose a volume, largest first."""
    edges = topology.find_edges(faces, len(vertices))
    oriented = topology.orient(faces, edges)
    faces = faces if oriented is None else oriented[0]
    edges = topology.find_edges(faces, len(vertices))
    if np.any(edges.count > 2) and len(kept := topology.without_flaps(faces)) < len(faces):
        done.append(f"{len(faces) - len(kept)} triangles were dropped that lay back to back")
        faces = kept
        edges = topology.find_edges(faces, len(vertices))
    if np.any(edges.count > 2):
        done.append("walls that met in one edge were taken apart")
        edges = topology.part_at_edges(vertices, faces, edges)
        vertices, faces, _ = topology.split_fans(vertices, faces, edges)
        edges = topology.find_edges(faces, len(vertices))
    body = topology.bodies(faces, edges, only_pairs=True)
    if (pieces := int(body.max()) + 1) > _MAX_PIECES:
        raise MeshError(f"{name} is in {pieces} pieces", remedy="export one closed surface", kind="bodies")
    holes, widest, dropped, torn, solids = 0, 0.0, 0, 0, []
    order = np.argsort(body, kind="stable")
    for members in np.split(order, np.cumsum(np.bincount(body))[:-1]):
        points, triangles = _compact(vertices, faces[members])
        points, triangles, closed, width = close_holes(points, triangles)
        if signed_volume(points, triangles) < 0.0:
            triangles = triangles[:, ::-1]
        solid = to_manifold(points, triangles)
        torn += str(solid.status()) != "Error.NoError"
        if solid.is_empty() or solid.volume() <= 0.0:
            dropped += 1
            continue
        holes, widest = holes + closed, max(widest, width)
        solids.append(solid)
    if holes:
        done.append(f"{counted(holes, 'hole')} closed, the widest {1e3 * widest:.1f} mm across")
    size = float(np.ptp(vertices, axis=0).max())
    if widest > _WIDE_SHARE * size:
        wide = f"{1e3 * widest:.0f} mm"
        warnings.append(f"a hole {wide} wide was closed by a guess, so compare it with the real object")
    if torn and (not solids or max(_size(solid) for solid in solids) < 0.8 * size):
        raise MeshError(f"{name} is too torn to be closed", remedy="remesh it", kind="open")
    if dropped:
        done.append(f"{counted(dropped, 'piece')} dropped for enclosing no volume")
    return sorted(solids, key=lambda solid: -float(solid.volume()))


def _size(solid: Any) -> float:
    low, high = np.reshape(solid.bounding_box(), (2, 3))
    return float((high - low).max())


def _compact(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Return a part of a mesh with its own vertices only; its cost does not grow with the whole."""
    used, corners = np.unique(faces, return_inverse=True)
    return vertices[used], corners.reshape(-1, 3)


def _one_body(
    solids: list[Any], name: str, done: list[str], warnings: list[str]
) -> tuple[FloatArray, IntArray]:
    import manifold3d

    if not solids:
        raise MeshError(f"no part of {name} encloses a volume", remedy="export a solid", kind="flat")
    if len(solids) == 1:
        return manifold_arrays(solids[0])
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    shells = sorted(union.decompose(), key=lambda shell: -float(shell.volume()))
    bodies = [shell for shell in shells if shell.volume() > 0.0]
    if len(bodies) < len(solids):
        done.append(f"{len(solids)} overlapping or nested bodies were joined into {len(bodies)}")
    if len(bodies) < len(shells):
        done.append(f"{counted(len(shells) - len(bodies), 'cavity', 'cavities')} filled")
    if len(bodies) > 1:
        share = bodies[1].volume() / bodies[0].volume()
        if share > _RIVAL_SHARE:
            raise MeshError(
                f"{name} has {len(bodies)} separate bodies, the second {100 * share:.0f} % of the first",
                remedy="keep only the one that is meant",
                kind="bodies",
                bodies=len(bodies),
            )
        dropped = counted(len(bodies) - 1, "stray piece")
        done.append(f"{dropped} dropped, the largest {100 * share:.2g} % of the body")
        if share > _STRAY_SHARE:
            warnings.append(f"the piece of {100 * share:.2g} % may be a part that is meant, so compare")
    return manifold_arrays(bodies[0])
