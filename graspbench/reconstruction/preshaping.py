"""The preshape: a first ellipsoid around the object, from the silhouettes' boxes (thesis 3.2.3)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection, QhullError

from graspbench.arrays import FloatArray, cross
from graspbench.errors import ReconstructionError, StationError
from graspbench.reconstruction.carving import coarse_border
from graspbench.reconstruction.ellipsoid import Ellipsoid, moment_ellipsoid, wrap
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.visual_hull import VisualHull

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

SIDES = 4
"""Planes a silhouette contributes: one for each side of its box."""

DEEP_SHARE = 0.01
"""A guess this share of the nearest camera's distance inside all planes needs no linear programme."""


def preshape(
    silhouettes: "Sequence[Silhouette]",
    centre: FloatArray,
    parameters: SurfaceParameters,
    *,
    hull: VisualHull | None = None,
) -> Ellipsoid:
    """Return the ellipsoid that wraps the polyhedron of the silhouettes' boxes, or the visual hull.

    Its axes and their ratios are those of the polyhedron's pseudo-inertia tensor. Around the hull, the
    tensor of the hull's own border points is tried as well, and the smaller ellipsoid taken.

    Args:
        silhouettes: With ideal pinhole cameras.
        centre: Guess of the object's centre, shape (3,); only conditions the numbers.
        parameters: `ground`, `wrap` and `margin` are read.
        hull: The visual hull, if it is there already.

    Raises:
        StationError: The stations do not enclose the object.
        ReconstructionError: The boxes, or the silhouettes, have no point in common.
    """
    vertices = polyhedron_vertices(silhouettes, centre, ground=parameters.ground)
    family = moment_ellipsoid(vertices)
    around = wrap(family, vertices, parameters.margin)
    if parameters.wrap == "polyhedron":
        return around
    if hull is None:
        hull = VisualHull(silhouettes, parameters.ground, smoothing_px=parameters.smoothing_px)
    border = coarse_border(hull, around)
    own = wrap(moment_ellipsoid(border), border, parameters.margin)
    return min(wrap(family, border, parameters.margin), own, key=lambda e: e.volume_m3)


def half_spaces(silhouettes: "Sequence[Silhouette]", ground: bool) -> tuple[FloatArray, FloatArray]:
    """Return the half-spaces A x <= d of all box sides (thesis 3.1), the ground last.

    Returns:
        Outward unit normals A, shape (4 n_img or 4 n_img + 1, 3), and offsets d.
    """
    cameras = [silhouette.camera for silhouette in silhouettes]
    rays = np.array([c.rays(_corners(s.box)) for c, s in zip(cameras, silhouettes, strict=True)])
    # Corners run clockwise seen by the camera, so this product points away from the box.
    following = rays[:, [1, 2, 3, 0]]
    normals = cross(following.reshape(-1, 3), rays.reshape(-1, 3))
    normals /= np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    origins = np.repeat(np.array([c.position for c in cameras]), SIDES, axis=0)
    offsets = np.einsum("ij,ij->i", normals, origins)
    if ground:
        normals = np.vstack((normals, [0.0, 0.0, -1.0]))
        offsets = np.append(offsets, 0.0)
    return normals, offsets


def _corners(box: tuple[float, float, float, float]) -> FloatArray:
    u_min, v_min, u_max, v_max = box
    return np.array([[u_min, v_min], [u_max, v_min], [u_max, v_max], [u_min, v_max]])


def polyhedron_vertices(
    silhouettes: "Sequence[Silhouette]", centre: FloatArray, *, ground: bool
) -> FloatArray:
    """Return the vertices of the polyhedron that all box sides and the ground bound.

    Args:
        silhouettes: With ideal pinhole cameras.
        centre: Guess of the object's centre, shape (3,).
        ground: Whether the plane z = 0 bounds it.

    Returns:
        Its basic feasible solutions, each once, shape (n_v, 3).

    Raises:
        StationError: The polyhedron is unbounded or reaches a camera.
        ReconstructionError: The polyhedron is empty.
    """
    if not silhouettes:
        raise StationError("the preshape has no silhouette", remedy="switch on at least one station")
    normals, offsets = half_spaces(silhouettes, ground)
    names = [silhouette.station for silhouette in silhouettes]
    cameras = np.array([silhouette.camera.position for silhouette in silhouettes])
    # Coordinates about the guess, in units of the nearest camera's distance.
    unit = float(np.linalg.norm(cameras - centre, axis=1).min())
    local = (offsets - normals @ centre) / unit
    # Any point well inside will do to start from; where it is has no influence on the vertices.
    inner = np.zeros(3) if local.min() > DEEP_SHARE else _chebyshev_centre(normals, local, names)
    # At the apex of its own cone a camera is a vertex unless another station or the ground cuts it off.
    reached = np.all((cameras - centre) / unit @ normals.T <= local + 1e-9, axis=1)
    if reached.any():
        raise _not_enclosed(
            names, f"the space they leave reaches the camera of {names[int(reached.argmax())]}"
        )
    try:
        polyhedron = HalfspaceIntersection(np.column_stack((normals, -local)), inner)
    except QhullError as error:
        raise ReconstructionError(
            "the polyhedron of the silhouettes' boxes is too thin to be computed",
            remedy="check the camera calibration and the silhouettes",
            stations=names,
        ) from error
    corners = polyhedron.intersections
    # Bounded is a polyhedron whose dual has the point inside it on its inner side everywhere.
    bounded = bool(np.all(polyhedron.dual_equations[:, -1] < 0.0)) and bool(np.all(np.isfinite(corners)))
    if not bounded or np.abs(corners).max() > 1e3:
        raise _not_enclosed(names, "the space they leave is unbounded")
    return _unique(corners, 1e-9) * unit + centre


def _chebyshev_centre(normals: FloatArray, offsets: FloatArray, names: list[str]) -> FloatArray:
    """Return the centre of the largest ball in A x <= d: one linear programme."""
    count = len(normals)
    programme = linprog(
        np.array([0.0, 0.0, 0.0, -1.0]),
        A_ub=np.column_stack((normals, np.ones(count))),
        b_ub=offsets,
        bounds=(None, None),
        method="highs",
    )
    if programme.status == 3:
        raise _not_enclosed(names, "the space they leave is unbounded")
    if programme.status != 0 or programme.x is None:
        raise ReconstructionError(
            f"the preshape's linear programme failed ({programme.message})", stations=names
        )
    radius = float(programme.x[3])
    if radius <= 1e-6:
        binding = np.flatnonzero(np.asarray(programme.ineqlin.marginals) < -1e-9)
        culprits = list(dict.fromkeys(names[k // SIDES] for k in binding if k < SIDES * len(names)))
        raise ReconstructionError(
            f"the boxes of stations {', '.join(culprits)} have no point in common",
            remedy="check the camera calibration and that the object did not move",
            stations=culprits,
        )
    centre: FloatArray = programme.x[:3]
    return centre


def _not_enclosed(names: list[str], why: str) -> StationError:
    return StationError(
        f"the stations {', '.join(names)} do not enclose the object, {why}",
        remedy="add stations that look from other sides, or switch the ground plane on",
        stations=names,
    )


def _unique(points: FloatArray, tolerance: float) -> FloatArray:
    """Return the points without repetitions: several planes may meet in one vertex."""
    gaps = np.abs(points[:, None] - points[None]).max(axis=2)
    first = (gaps < tolerance).argmax(axis=1)
    unique: FloatArray = points[first == np.arange(len(points))]
    return unique
