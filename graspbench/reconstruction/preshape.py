"""The preshape: a first ellipsoid around the object, from the silhouettes' boxes (thesis 3.2.3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection, QhullError

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError, StationError
from graspbench.reconstruction.parameters import SurfaceParameters

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

SIDES = 4
"""Planes a silhouette contributes: one for each side of its box."""


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid in the world.

    Attributes:
        centre: Shape (3,).
        axes: Unit axes as columns, right-handed, shape (3, 3).
        semi_axes: Lengths of the semi-axes, descending, shape (3,).
    """

    centre: FloatArray
    axes: FloatArray
    semi_axes: FloatArray

    def level(self, points: FloatArray) -> FloatArray:
        """Return the factor by which the ellipsoid must grow to reach each point, shape (n,)."""
        levels: FloatArray = np.linalg.norm((points - self.centre) @ self.axes / self.semi_axes, axis=1)
        return levels

    @property
    def volume_m3(self) -> float:
        """Enclosed volume."""
        return float(4.0 / 3.0 * np.pi * np.prod(self.semi_axes))


def preshape(
    silhouettes: "Sequence[Silhouette]", centre: FloatArray, parameters: SurfaceParameters
) -> Ellipsoid:
    """Return the ellipsoid that wraps the polyhedron of the silhouettes' boxes.

    Its axes and their ratios are those of the vertices' pseudo-inertia tensor.

    Args:
        silhouettes: With ideal pinhole cameras.
        centre: Guess of the object's centre, shape (3,); only conditions the numbers.
        parameters: `ground` and `margin` are read.

    Raises:
        StationError: The stations do not enclose the object.
        ReconstructionError: The boxes have no point in common.
    """
    vertices = polyhedron_vertices(silhouettes, centre, ground=parameters.ground)
    return wrap(moment_ellipsoid(vertices), vertices, parameters.margin)


def half_spaces(silhouettes: "Sequence[Silhouette]", ground: bool) -> tuple[FloatArray, FloatArray]:
    """Return the half-spaces A x <= d of all box sides (thesis 3.1), the ground last.

    Returns:
        Outward unit normals A, shape (4 n_img or 4 n_img + 1, 3), and offsets d.
    """
    cameras = [silhouette.camera for silhouette in silhouettes]
    rays = np.array([c.rays(_corners(s.box)) for c, s in zip(cameras, silhouettes, strict=True)])
    # Corners run clockwise seen by the camera, so this product points away from the box.
    following = rays[:, [1, 2, 3, 0]]
    normals = _cross(following.reshape(-1, 3), rays.reshape(-1, 3))
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


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the row-wise cross products of (n, 3) arrays, faster than numpy's general one."""
    return np.column_stack(
        (
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        )
    )


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
    inner = _chebyshev_centre(normals, local, names)
    # At the apex of its own cone a camera is a vertex unless another station or the ground cuts it off.
    reached = np.all((cameras - centre) / unit @ normals.T <= local + 1e-9, axis=1)
    if reached.any():
        raise _not_enclosed(
            names, f"the space they leave reaches the camera of {names[int(reached.argmax())]}"
        )
    try:
        corners = HalfspaceIntersection(np.column_stack((normals, -local)), inner).intersections
    except QhullError as error:
        raise ReconstructionError(
            "the polyhedron of the silhouettes' boxes is too thin to be computed",
            remedy="check the camera calibration and the silhouettes",
            stations=names,
        ) from error
    if not np.all(np.isfinite(corners)) or np.abs(corners).max() > 1e3:
        raise _not_enclosed(names, "the space they leave is unbounded")
    return _unique(corners, 1e-9) * unit + centre


def moment_ellipsoid(points: FloatArray) -> Ellipsoid:
    """Return the ellipsoid of the points' pseudo-inertia tensor (thesis 3.2.3), one standard deviation.

    The first two axes point to where the points' third moment along them is positive, so that the
    frame turns with the points; the third makes it right-handed.

    Args:
        points: Not all in one plane, shape (n, 3).

    Raises:
        ReconstructionError: The points lie in a plane.
    """
    mean = points.mean(axis=0)
    about = points - mean
    values, vectors = np.linalg.eigh(about.T @ about / len(points))
    if values[0] <= 1e-10 * values[2]:
        raise ReconstructionError(
            "the space that the silhouettes leave has no volume",
            remedy="check the camera calibration and the silhouettes",
        )
    axes = vectors[:, ::-1].copy()
    for k in range(2):
        skewness = np.mean((about @ axes[:, k]) ** 3) / values[2 - k] ** 1.5
        lead = axes[np.abs(axes[:, k]).argmax(), k]
        if (skewness if abs(skewness) > 1e-6 else lead) < 0:
            axes[:, k] *= -1.0
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return Ellipsoid(mean, axes, np.sqrt(values[::-1]))


def wrap(ellipsoid: Ellipsoid, points: FloatArray, margin: float) -> Ellipsoid:
    """Scale an ellipsoid so that it just wraps the points, times a margin."""
    return scaled(ellipsoid, float(ellipsoid.level(points).max()) * margin)


def scaled(ellipsoid: Ellipsoid, factor: float) -> Ellipsoid:
    """Return the ellipsoid with its semi-axes multiplied by ``factor``."""
    return Ellipsoid(ellipsoid.centre, ellipsoid.axes, ellipsoid.semi_axes * factor)


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
    if programme.status != 0:
        raise ReconstructionError(
            f"the preshape's linear programme failed ({programme.message})", stations=names
        )
    radius = float(programme.x[3])
    if radius <= 1e-6:
        binding = np.flatnonzero(np.asarray(programme.ineqlin.marginals) < -1e-9)
        culprits = list(dict.fromkeys(names[k // SIDES] for k in binding if k < SIDES * len(names)))
        raise ReconstructionError(
            f"no point lies in the boxes of all silhouettes, those of {', '.join(culprits)} exclude each other",
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
