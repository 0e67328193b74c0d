"""Preflight of meshes: whether one can be a trial's object, and if not, why."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import MeshError
from graspbench.geometry import topology
from graspbench.geometry.handles import is_spurious, thinnest_loop
from graspbench.geometry.intersections import self_intersections
from graspbench.geometry.units import guess_scale

_MAX_SEARCHED = 100_000
"""Triangles of a surface whose handles are still looked at, which takes seconds then."""

LARGEST_M, SMALLEST_M = 2.0, 0.002
_MEASURABLE_M = (1e-12, 1e12)
_FLAT_SHARE = 1e-5
"""A body thinner than this share of its length, or of less than this share of its box's cube, is no solid."""


@dataclass(frozen=True)
class MeshProblem:
    """One reason why a mesh cannot be used.

    Attributes:
        kind: One word for programs: "missing", "open", "bodies", "genus", ...
        what: What is wrong, a clause without full stop.
        remedy: What to do, a clause without full stop.
        repairable: Whether :func:`graspbench.geometry.repair_mesh` can do something about it.
    """

    kind: str
    what: str
    remedy: str
    repairable: bool = False

    def __str__(self) -> str:
        return f"{self.what}: {self.remedy}."


@dataclass(frozen=True)
class MeshReport:
    """What the preflight found.

    Attributes:
        name: The file's name, or what the mesh was called.
        usable: Whether a trial can use the mesh as it is (after the repairs listed).
        problems: Why not.
        repairs: What was changed, harmless unless a repair was asked for; one sentence each.
        warnings: What was assumed; one sentence each.
        vertices: Number of vertices after welding.
        triangles: Number of triangles after welding.
        bodies: Number of connected surfaces; None when the mesh could not be read.
        watertight: Whether every edge has two triangles.
        genus: Handles over all bodies; None for a surface that is open or has one side only.
        extents_m: Size of the bounding box.
        volume_m3: Enclosed volume; None for a surface that is not closed.
        self_intersecting: Triangles that pierce others; 0 also where this was not looked for.
    """

    name: str
    usable: bool = False
    problems: tuple[MeshProblem, ...] = ()
    repairs: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    vertices: int = 0
    triangles: int = 0
    bodies: int | None = None
    watertight: bool = False
    genus: int | None = None
    extents_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    volume_m3: float | None = None
    self_intersecting: int = 0

    def error(self) -> MeshError:
        """Return the first problem as an error that carries the report."""
        first = self.problems[0]
        return MeshError(first.what, remedy=first.remedy, kind=first.kind, report=self)


def inspect(
    vertices: FloatArray, faces: IntArray, name: str, *, trusted: bool = False
) -> tuple[FloatArray, IntArray, MeshReport]:
    """Clean a triangle set without changing its shape, and report on it.

    Cleaning welds coinciding vertices, drops degenerate and duplicate triangles, and turns inverted ones.

    Args:
        vertices: Shape (n, 3), m.
        faces: Shape (m, 3).
        name: What to call it in sentences.
        trusted: Do not look for self-intersections, which costs most of the time.

    Returns:
        Vertices, triangles, and the report.
    """
    report = MeshReport(name, vertices=len(vertices), triangles=len(faces))

    def refused(*problems: MeshProblem) -> tuple[FloatArray, IntArray, MeshReport]:
        return vertices, faces, replace(report, problems=problems)

    if len(faces) == 0:
        return refused(MeshProblem("empty", f"{name} holds no triangles", "export a triangle mesh"))
    vertices, faces = topology.without_unused(vertices, faces)
    if bad := int(np.sum(~np.all(np.isfinite(vertices), axis=1))):
        return refused(
            MeshProblem(
                "nan",
                f"{name} has {bad} {'vertex that is' if bad == 1 else 'vertices that are'} not finite",
                "export it again, or drop them with a repair",
                True,
            )
        )
    extents = np.ptp(vertices, axis=0)
    report = replace(report, extents_m=(float(extents[0]), float(extents[1]), float(extents[2])))
    if not extents.any():
        return refused(MeshProblem("flat", f"all vertices of {name} coincide", "export it again"))
    if not _MEASURABLE_M[0] < extents.max() < _MEASURABLE_M[1]:  # products of such lengths may overflow
        return refused(*_size_problems(name, extents))

    before = len(faces)
    vertices, faces = topology.weld(vertices, faces)
    repairs = []
    if lost := before - len(faces):
        repairs.append(f"{counted(lost, 'degenerate or duplicate triangle')} dropped")
    report = replace(report, vertices=len(vertices), triangles=len(faces), repairs=tuple(repairs))
    problems = list(_size_problems(name, extents))
    if len(faces) == 0:
        return refused(
            *problems, MeshProblem("flat", f"{name} has no triangle with an area", "export it again")
        )
    if _is_flat(vertices):
        return refused(*problems, MeshProblem("flat", f"{name} is flat", "export a solid, not a sheet"))

    edges = topology.find_edges(faces, len(vertices))
    if np.any(edges.count > 2) and len(single := topology.without_backs(faces)) < len(faces):
        repairs.append(f"{counted(len(single), 'triangle')} dropped that repeated another one's back")
        faces, edges = single, topology.find_edges(single, len(vertices))
        report = replace(report, triangles=len(faces))
    body = topology.bodies(faces, edges)
    bodies = int(body.max()) + 1
    watertight = bool(np.all(edges.count == 2))
    report = replace(report, bodies=bodies, watertight=watertight)
    problems += _edge_problems(name, edges.count)
    if bodies > 1:
        problems.append(
            MeshProblem(
                "bodies", f"{name} consists of {bodies} bodies", "keep one, or join them with a repair", True
            )
        )
    oriented = topology.orient(faces, edges)
    if oriented is None:
        problems.append(MeshProblem("one_sided", f"{name} is a surface with one side only", "export a solid"))
        return refused(*problems)
    faces, turned = oriented
    if turned:
        repairs.append(f"{counted(turned, 'inverted triangle')} turned")
    if watertight:
        edges = topology.find_edges(faces, len(vertices)) if turned else edges
        vertices, faces, pinched = topology.split_fans(vertices, faces, edges)
        if pinched:
            repairs.append(f"{counted(pinched, 'vertex', 'vertices')} split where the surface touches itself")
        faces, volumes, inverted = _outward(vertices, faces, body, bodies)
        if inverted:
            repairs.append("the surface was inside out and was inverted")
        genera = _genera(faces, body, bodies)
        report = replace(report, vertices=len(vertices), genus=sum(genera), volume_m3=float(volumes.sum()))
        problems += _solid_problems(name, volumes, extents) or _genus_problems(name, vertices, faces, genera)
    if not trusted and not any(problem.kind in ("units", "flat", "too_fine") for problem in problems):
        report = with_intersections(report, int(self_intersections(vertices, faces).sum()))
    problems += report.problems
    report = replace(report, usable=not problems, problems=tuple(problems), repairs=tuple(repairs))
    return vertices, faces, report


def with_intersections(report: MeshReport, pierced: int) -> MeshReport:
    """Return a report that says how many triangles pierce others."""
    if pierced == 0:
        return report
    what = f"{report.name} intersects itself ({pierced} triangles are pierced)"
    problem = MeshProblem("self_intersecting", what, "remesh it, or try a repair", True)
    return replace(report, usable=False, problems=(*report.problems, problem), self_intersecting=pierced)


def _is_flat(vertices: FloatArray) -> bool:
    """Whether all vertices lie in one plane or on one line, whichever way it is turned."""
    centred = vertices - vertices.mean(axis=0)
    spread = np.linalg.eigvalsh(centred.T @ centred)
    return bool(spread[0] <= _FLAT_SHARE**2 * spread[2])


def _size_problems(name: str, extents: FloatArray) -> list[MeshProblem]:
    largest = float(extents.max())
    if SMALLEST_M <= largest <= LARGEST_M:
        return []
    what = f"{name} is {_length(largest)} large, so it is hardly in metres"
    guess = guess_scale(largest)
    remedy = f"try object.scale={guess:g}" if guess else "set object.scale so that it measures 0.03 to 0.2 m"
    return [MeshProblem("units", what, remedy)]


def counted(number: int, noun: str, plural: str | None = None) -> str:
    """Return a number with its noun and the verb: ``1 hole was``, ``2 holes were``."""
    return f"{number} {noun} was" if number == 1 else f"{number} {plural or noun + 's'} were"


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 0.1 else f"{1e3 * metres:.3g} mm"


def _edge_problems(name: str, count: IntArray) -> list[MeshProblem]:
    problems = []
    if border := int(np.sum(count == 1)):
        problems.append(
            MeshProblem(
                "open",
                f"{name} is open ({border} of its edges have only one triangle)",
                "close its holes with a repair",
                True,
            )
        )
    if shared := int(np.sum(count > 2)):
        problems.append(
            MeshProblem(
                "non_manifold",
                f"{name} has {shared} {'edge' if shared == 1 else 'edges'} with more than two triangles",
                "remove inner walls, or join touching bodies with a repair",
                True,
            )
        )
    return problems


def _outward(
    vertices: FloatArray, faces: IntArray, body: IntArray, bodies: int
) -> tuple[IntArray, FloatArray, bool]:
    """Turn every body's surface outwards; return triangles, volumes, and whether one was inside out."""
    corners = (vertices - vertices.mean(axis=0))[faces]
    each = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    volumes = np.bincount(body, weights=each, minlength=bodies)
    inverted = volumes < 0.0
    if inverted.any():
        faces = np.where(inverted[body][:, None], faces[:, ::-1], faces)
    return faces, np.abs(volumes), bool(inverted.any())


def _genera(faces: IntArray, body: IntArray, bodies: int) -> list[int]:
    # After the split no vertex belongs to two bodies.
    owner = np.full(int(faces.max()) + 1, -1, dtype=np.int64)
    owner[faces] = body[:, None]
    n_vertices = np.bincount(owner[owner >= 0], minlength=bodies)
    n_faces = np.bincount(body, minlength=bodies)
    return [topology.genus(int(v), int(f)) for v, f in zip(n_vertices, n_faces, strict=True)]


def _solid_problems(name: str, volumes: FloatArray, extents: FloatArray) -> list[MeshProblem]:
    if volumes.max() < _FLAT_SHARE * float(extents.max()) ** 3:
        return [MeshProblem("flat", f"{name} encloses next to no volume", "export a solid, not a sheet")]
    return []


def _genus_problems(name: str, vertices: FloatArray, faces: IntArray, genera: list[int]) -> list[MeshProblem]:
    handles = sum(genera)
    if handles == 0 or len(genera) > 1 or len(faces) > _MAX_SEARCHED:
        return []
    girth = thinnest_loop(vertices, faces)[1]
    if not is_spurious(girth, vertices):
        return []
    holes = "a hole" if handles == 1 else f"{handles} holes"
    what = f"{name} has {holes} through it, only {_length(girth)} around where the thinnest is"
    return [MeshProblem("genus", what, "cut it with a repair, since it may be a scan's error", True)]
