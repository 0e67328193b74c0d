"""Charts: smooth parametrisations of an object's surface, with their Gauss frame (thesis 4.2).

A chart maps (u, v) to a point c of the surface in the object frame. Planes, spheres, ellipsoids,
cylinders and surfaces of revolution have orthogonal charts. The patch of a mesh is orthogonal at its
centre only; its Gauss frame takes x along c_u, z along the outward normal, and y to complete
them, which for an orthogonal chart is the frame of thesis figure 4.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.manipulation.compiled.chart_formulas import HEADER, ChartKind, chart_derivatives, gauss_frame


class ChartPoint(NamedTuple):
    """A surface point and its differential geometry, in the object frame.

    Attributes:
        point: c, shape (3,), m.
        tangents: [c_u, c_v], shape (3, 2).
        frame: Gauss frame R_c^o, shape (3, 3); the third column is the outward normal.
        spin: Matrix C, shape (3, 2): angular velocity of the contact frame per unit (u', v') (4.4).
    """

    point: FloatArray
    tangents: FloatArray
    frame: FloatArray
    spin: FloatArray


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart, as numbers that compiled code can read.

    Attributes:
        kind: Its formula.
        parameters: Rotation (9) and origin (3) of the chart in the object frame, then the formula's
            own numbers; shape (n,).
        domain: [[u_min, u_max], [v_min, v_max]], shape (2, 2): where the chart may be used.
        name: Kind of surface, for messages.
    """

    kind: ChartKind
    parameters: FloatArray
    domain: FloatArray = field(default_factory=lambda: np.array([[-1e3, 1e3], [-1e3, 1e3]]))
    name: str = "plane"

    def __call__(self, xi: Sequence[float] | FloatArray) -> ChartPoint:
        """Return point, tangents, Gauss frame and C at ``xi`` = (u, v)."""
        derivatives, frame, spin = np.empty((6, 3)), np.empty((3, 3)), np.empty((3, 2))
        chart_derivatives(int(self.kind), self.parameters, float(xi[0]), float(xi[1]), derivatives)
        gauss_frame(derivatives, frame, spin)
        return ChartPoint(derivatives[0].copy(), derivatives[1:3].T.copy(), frame, spin)

    def locate(self, point: FloatArray, *, tolerance_m: float = 5e-3) -> FloatArray:
        """Return the coordinates (u, v) of the chart's point nearest to ``point``, shape (2,).

        Raises:
            ManipulationError: The chart has no point within ``tolerance_m``.
        """
        low = np.maximum(self.domain[:, 0], -4.0)
        high = np.minimum(self.domain[:, 1], 4.0)
        grid = np.stack(np.meshgrid(*np.linspace(low, high, 25).T), axis=-1).reshape(-1, 2)
        distance = [float(np.sum((self(xi).point - point) ** 2)) for xi in grid]
        xi = grid[int(np.argmin(distance))]
        for _ in range(30):
            at = self(xi)
            step, *_ = np.linalg.lstsq(at.tangents, point - at.point, rcond=None)
            xi = np.clip(xi + step, self.domain[:, 0], self.domain[:, 1])
            if np.abs(step).max() < 1e-14:
                break
        gap = float(np.linalg.norm(self(xi).point - point))
        if gap > tolerance_m:
            raise ManipulationError(
                f"the point is {gap * 1e3:.2f} mm off the {self.name} chart",
                remedy="use a chart around the contact",
                point=point,
                gap_m=gap,
            )
        return np.asarray(xi, dtype=np.float64)

    def contains(self, xi: FloatArray) -> bool:
        """Return whether ``xi`` lies in the chart's domain."""
        return bool(np.all(self.domain[:, 0] <= xi) and np.all(xi <= self.domain[:, 1]))


def plane(
    *, rotation: FloatArray | None = None, origin: FloatArray | None = None, half_size_m: float = 1e3
) -> Chart:
    """Return the plane c = (u, v, 0), normal z, of the frame (rotation, origin)."""
    box = np.array([[-half_size_m, half_size_m]] * 2)
    return _chart(ChartKind.PLANE, rotation, origin, [], box, "plane")


def sphere(radius_m: float, *, towards: FloatArray | None = None, origin: FloatArray | None = None) -> Chart:
    """Return a sphere by longitude u and latitude v, (0, 0) in the direction ``towards``.

    The poles, where longitude fails, are 90 deg from ``towards``: put it near the contact.
    """
    _positive(radius_m)
    rotation = None if towards is None else _frame_x(towards)
    return _chart(ChartKind.SPHERE, rotation, origin, [radius_m], _sphere_box(), "sphere")


def cylinder(
    radius_m: float, *, rotation: FloatArray | None = None, origin: FloatArray | None = None
) -> Chart:
    """Return the cylinder about z of the given frame, by angle u (rad) and height v (m)."""
    _positive(radius_m)
    box = np.array([[-np.pi, np.pi], [-1e3, 1e3]])
    return _chart(ChartKind.CYLINDER, rotation, origin, [radius_m], box, "cylinder")


def ellipsoid(
    semi_axes_m: Sequence[float] | FloatArray,
    *,
    rotation: FloatArray | None = None,
    origin: FloatArray | None = None,
) -> Chart:
    """Return an ellipsoid by its lines of curvature, which are orthogonal for three unequal axes.

    u goes around the shortest axis and v is the latitude towards it (Jacobi's ellipsoidal
    coordinates); the chart fails at the four umbilical points only, sin u = cos v = 0, which lie
    in the plane of the longest and the shortest axis.

    Args:
        semi_axes_m: Semi-axes along x, y, z of the given frame, in any order.
        rotation: Orientation of the axes in the object frame, shape (3, 3).
        origin: Centre in the object frame, shape (3,).
    """
    axes = np.asarray(semi_axes_m, dtype=np.float64)
    _positive(*axes)
    base = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    if np.ptp(axes) < 1e-4 * axes.max():
        return _chart(ChartKind.SPHERE, base, origin, [float(axes.mean())], _sphere_box(), "sphere")
    order = np.argsort(-axes, kind="stable")
    columns = base[:, order]
    if np.linalg.det(columns) < 0.0:
        columns[:, 2] *= -1.0
    return _chart(ChartKind.ELLIPSOID, columns, origin, list(axes[order]), _sphere_box(), "ellipsoid")


def revolution(
    radii_m: Sequence[float] | FloatArray,
    heights_m: Sequence[float] | FloatArray,
    *,
    rotation: FloatArray | None = None,
    origin: FloatArray | None = None,
) -> Chart:
    """Return the surface of revolution about z whose profile is the spline through the given points.

    u is the angle about z; v runs from 0 to 1 along the profile's knots, upwards (so that the normal
    points outwards for a profile with its heights ascending on the whole).

    Args:
        radii_m: Distances from the axis at the knots, shape (n,), n >= 4, positive.
        heights_m: Heights at the knots, shape (n,).
        rotation: Orientation of the axis frame in the object frame.
        origin: Its origin in the object frame.
    """
    radii, heights = np.asarray(radii_m, dtype=np.float64), np.asarray(heights_m, dtype=np.float64)
    if radii.ndim != 1 or radii.shape != heights.shape or radii.size < 4:
        raise ConfigurationError("a profile needs radii and heights of one length, 4 or more")
    _positive(*radii)
    from scipy.interpolate import CubicSpline  # slow to import, and only needed here

    knots = np.linspace(0.0, 1.0, radii.size)
    spline = CubicSpline(knots, np.column_stack([radii, heights]))
    numbers = [float(radii.size - 1), *spline.c.transpose(1, 0, 2).reshape(-1)]
    box = np.array([[-np.pi, np.pi], [0.0, 1.0]])
    return _chart(ChartKind.REVOLUTION, rotation, origin, numbers, box, "revolution")


def mesh_patch(
    points: FloatArray, centre: FloatArray, normal: FloatArray, *, radius_m: float = 0.015
) -> Chart:
    """Return a local chart on a mesh surface: a cubic height field over the tangent plane.

    The cubic is a least-squares fit to the vertices nearest the centre, weighted towards it, and
    passes through the centre; so the chart is smooth where the mesh has edges.

    Args:
        points: Vertices of the surface, object frame, shape (n, 3).
        centre: Where the chart is (0, 0), on the surface, shape (3,).
        normal: Outward unit normal there, shape (3,).
        radius_m: Size of the neighbourhood that is fitted, and of the chart's domain.

    Raises:
        ManipulationError: The neighbourhood holds too few vertices.
    """
    rotation = _frame_x(normal)[:, [1, 2, 0]]
    local = (points - centre) @ rotation
    flat = np.hypot(local[:, 0], local[:, 1])
    near = np.flatnonzero((flat < radius_m) & (np.abs(local[:, 2]) < radius_m))
    if near.size < 12:  # a coarse mesh: take the nearest vertices, however far
        reach = np.linalg.norm(local, axis=1)
        near = np.argsort(reach, kind="stable")[: min(16, len(points))]
        if near.size < 12:
            raise ManipulationError(
                "too few vertices for a chart around the contact", remedy="use a finer surface"
            )
    u, v, height = local[near].T / radius_m
    weights = np.exp(-0.5 * (u**2 + v**2) / 0.5**2) + 1e-3
    terms = np.column_stack([u, v, u * u, u * v, v * v, u**3, u * u * v, u * v * v, v**3])
    # The ridge decides the cubic terms when the vertices do not.
    ridge = np.diag(1e-3 * np.array([0, 0, 0.01, 0.01, 0.01, 1, 1, 1, 1]) * near.size)
    gram = terms.T @ (weights[:, None] * terms) + ridge
    fit = np.linalg.solve(gram, terms.T @ (weights * height))
    degree = np.array([1, 1, 2, 2, 2, 3, 3, 3, 3])
    coefficients = fit * radius_m / radius_m**degree
    box = np.array([[-radius_m, radius_m]] * 2)
    return _chart(ChartKind.PATCH, rotation, centre, list(coefficients), box, "mesh patch")


def _chart(
    kind: ChartKind,
    rotation: FloatArray | None,
    origin: FloatArray | None,
    numbers: Sequence[float],
    domain: FloatArray,
    name: str,
) -> Chart:
    matrix = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-9) or np.linalg.det(matrix) < 0.0:
        raise ConfigurationError(f"the {name} chart's rotation is not a rotation matrix", rotation=rotation)
    start = np.zeros(3) if origin is None else np.asarray(origin, dtype=np.float64)
    parameters = np.concatenate([matrix.reshape(9), start, np.asarray(numbers, dtype=np.float64)])
    assert parameters.size == HEADER + len(numbers)
    return Chart(kind, parameters, domain, name)


def _sphere_box() -> FloatArray:
    return np.array([[-np.pi, np.pi], [-0.49 * np.pi, 0.49 * np.pi]])


def _positive(*values: float) -> None:
    if not all(value > 0.0 and np.isfinite(value) for value in values):
        raise ConfigurationError("a chart's lengths must be positive", values=values)


def _frame_x(direction: FloatArray) -> FloatArray:
    """Return a rotation whose x axis is along ``direction``; y is as horizontal as possible."""
    x = np.asarray(direction, dtype=np.float64)
    x = x / np.linalg.norm(x)
    helper = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])
