"""The thesis' index: a field of forces that shapes the grasp (thesis 3.4.2, equation 3.2).

Every contact feels f = f_PI + f_cm + f_e + f_a + f_b, projected on the surface's tangent plane:

* f_PI = k_pi (p^PI - p) / l            contacts onto one plane PI,
* f_cm = k_cm (c - c^PI) / l            that plane to the centroid,
* f_e = k_e (theta_i - 2 pi / n_f) / a  along t_i, an equilateral grasp,
* f_a = k_a (p^PI - c^PI) / |..|        a large grasp polygon,
* f_b = k_b times the kinematic barrier of the hand.

The terms have different units, so equal coefficients weigh them equally only relative to a length l and
an angle a that count as one unit of error. With l = 1 m and a = 1 rad the pull outwards, which is 1 N
always, drowns the others (1 N against 0.002 N for 2 mm); the defaults are l = 1 mm and a = 1 degree.

On a surface made of nodes f_a never vanishes, so "all projected forces are below sigma_f" is rarely
reached, and following the forces alone ends in a cycle between neighbours. Each term but f_b is the
gradient of a potential (f_e up to the part of the neighbour that it pursues); a move counts only if it
goes along the force AND lowers the potential

    V = sum_i k_pi d_i^2 / 2 l + n_f k_cm h^2 / 2 l + r k_e e_i^2 / 4 a - k_a r_i + k_b s_i b_i

with d_i, r_i the contact's distances from the plane and, in it, from c^PI; h the centroid's distance from the plane;
e_i the angle's error; r the surface's mean radius; b_i the barrier value and s_i the contour's mean spacing. So the
planner cannot cycle, and a local optimum is a stable one. While the surface still moves, single contacts
move; once it is at rest, up to three contacts may move together, which gets the grasp out of places where the
plane can only be shifted by several fingers at once.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.planning.grip_plane import fit_plane, next_angles
from graspbench.planning.index import INDICES, Moves
from graspbench.reconstruction.surface import Surface

if TYPE_CHECKING:
    from graspbench.grasp.quality import QualityParameters


@dataclass(frozen=True)
class ForceFieldParameters:
    """Coefficients of the force field (thesis 3.4.2)."""

    k_pi: Annotated[float, Field(ge=0, description="Pull of the contacts onto one plane, N per unit length")] = 1.0
    k_cm: Annotated[float, Field(ge=0, description="Pull of the plane to the centroid, N per unit length; 0: off")] = 1.0
    k_e: Annotated[float, Field(ge=0, description="Pull to an equilateral grasp, N per unit angle")] = 1.0
    k_a: Annotated[float, Field(ge=0, description="Push outwards, to a larger grasp polygon, N")] = 1.0
    k_b: Annotated[float, Field(ge=0, description="Weight of the kinematic barrier of the hand")] = 1.0
    sigma_f: Annotated[float, Field(ge=0, description="Tangential force below which a contact stays, N")] = 0.002
    length_unit_m: Annotated[float, Field(gt=0, description="Distance that counts as one unit of error")] = 1e-3
    angle_unit_deg: Annotated[float, Field(gt=0, description="Angle that counts as one unit of error")] = 1.0


@dataclass(frozen=True)
class FieldForces:
    """The force on every contact, term by term; each of shape (n_f, 3), N.

    Attributes:
        plane: f_PI, onto the least squares plane.
        centroid: f_cm, plane to the centroid.
        equilateral: f_e, to equal angles.
        area: f_a, outwards.
        barrier: f_b, away from what the hand cannot do.
        projected: f', the sum without its part along the surface normal.
    """

    plane: FloatArray
    centroid: FloatArray
    equilateral: FloatArray
    area: FloatArray
    barrier: FloatArray
    projected: FloatArray

    @property
    def total(self) -> FloatArray:
        """The sum f of all terms, shape (n_f, 3)."""
        return self.plane + self.centroid + self.equilateral + self.area + self.barrier


def field_forces(
    points: FloatArray,
    normals: FloatArray,
    centroid: FloatArray,
    parameters: ForceFieldParameters,
    barrier_force: FloatArray | None = None,
) -> FieldForces:
    """Evaluate the force field term by term (thesis 3.2).

    Args:
        points: Contacts in cyclic order, shape (n_f, 3), m.
        normals: Outward unit surface normals there, shape (n_f, 3).
        centroid: Centroid of the surface, shape (3,).
        parameters: The coefficients.
        barrier_force: Kinematic barrier of each contact before its weight k_b, shape (n_f, 3), N; None for none.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    terms = np.zeros((4, len(points), 3))
    _field(points, np.ascontiguousarray(centroid, dtype=np.float64), _coefficients(parameters), terms)
    barrier = np.zeros_like(points) if barrier_force is None else parameters.k_b * barrier_force
    total = terms.sum(axis=0) + barrier
    projected = total - (total * normals).sum(axis=1, keepdims=True) * normals
    return FieldForces(terms[0], terms[1], terms[2], terms[3], barrier, projected)


def field_potential(
    points: FloatArray, centroid: FloatArray, radius_m: float, parameters: ForceFieldParameters
) -> float:
    """Evaluate the potential that the moves lower, barrier left out, J.

    Args:
        points: Contacts in cyclic order, shape (n_f, 3), m.
        centroid: Centroid of the surface, shape (3,).
        radius_m: Mean distance of the surface from its centroid.
        parameters: The coefficients.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    value: float = _potential(
        points, np.ascontiguousarray(centroid, dtype=np.float64), _coefficients(parameters), radius_m
    )
    return value


@INDICES.register("force_field")
class ForceField:
    """Index that follows the force field to a minimum of its potential.

    Args:
        parameters: Its coefficients.
        n_f: Number of fingers, at least 2.
        quality: Not used.

    Raises:
        ConfigurationError: Fewer than two fingers.
    """

    parameters: ClassVar[type[ForceFieldParameters]] = ForceFieldParameters

    def __init__(
        self, parameters: ForceFieldParameters, n_f: int, quality: "QualityParameters | None" = None
    ) -> None:
        if n_f < 2:
            raise ConfigurationError(
                f"the force field needs at least 2 fingers, not {n_f}", remedy="use a hand with more", n_f=n_f
            )
        self._parameters = parameters
        self._coefficients = _coefficients(parameters)

    def propose(self, surface: Surface, vertices: IntArray, moves: Moves) -> IntArray | None:
        """Return the next vertices, or None when no allowed move lowers the potential."""
        proposed = vertices.copy()
        changed = _propose(
            surface.points,
            surface.normals,
            surface.centroid,
            moves.nodes,
            moves.barrier * self._parameters.k_b,
            moves.barrier_force * self._parameters.k_b,
            self._coefficients,
            self._parameters.sigma_f,
            surface.at_rest,
            proposed,
        )
        return proposed if changed else None

    def score(self, surface: Surface, vertices: IntArray) -> float:
        """Return minus the potential, J."""
        return -field_potential(
            surface.points[vertices], surface.centroid, _mean_radius(surface.points, surface.centroid), self._parameters
        )

    def forces(self, surface: Surface, vertices: IntArray, moves: Moves | None = None) -> FieldForces:
        """Return the forces on the contacts at ``vertices``, term by term."""
        return field_forces(
            surface.points[vertices],
            surface.normals[vertices],
            surface.centroid,
            self._parameters,
            None if moves is None else moves.barrier_force,
        )


def _coefficients(parameters: ForceFieldParameters) -> FloatArray:
    """Return k_pi / l, k_cm / l, k_e / a, k_a in SI units."""
    length, angle = parameters.length_unit_m, np.deg2rad(parameters.angle_unit_deg)
    return np.array(
        [parameters.k_pi / length, parameters.k_cm / length, parameters.k_e / angle, parameters.k_a]
    )


@njit(cache=True, nogil=True)
def _mean_radius(points: FloatArray, centroid: FloatArray) -> float:
    total = 0.0
    for node in range(points.shape[0]):
        square = 0.0
        for a in range(3):
            square += (points[node, a] - centroid[a]) ** 2
        total += np.sqrt(square)
    return total / points.shape[0]


@njit(cache=True, nogil=True)
def _field(points: FloatArray, centroid: FloatArray, k: FloatArray, terms: FloatArray) -> None:
    """Write f_PI, f_cm, f_e, f_a of every contact, ``terms`` of shape (4, n_f, 3)."""
    n_f = points.shape[0]
    flat, centre = np.empty((n_f, 3)), np.empty(3)
    normal = _flatten(points, centroid, flat, centre)
    angles = np.empty(n_f)
    next_angles(flat, centre, normal, angles)
    outwards = np.empty(3)
    for i in range(n_f):
        square = 0.0
        for a in range(3):
            outwards[a] = flat[i, a] - centre[a]
            square += outwards[a] ** 2
        error = angles[i] - 2.0 * np.pi / n_f
        for a in range(3):
            outwards[a] = outwards[a] / np.sqrt(square) if square > 0.0 else 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            # The contacts are counter-clockwise about the normal, so this points to the next one.
            tangent = normal[b] * outwards[c] - normal[c] * outwards[b]
            terms[0, i, a] = k[0] * (flat[i, a] - points[i, a])
            terms[1, i, a] = k[1] * (centroid[a] - centre[a])
            terms[2, i, a] = k[2] * error * tangent
            terms[3, i, a] = k[3] * outwards[a]


@njit(cache=True, nogil=True)
def _flatten(points: FloatArray, centroid: FloatArray, flat: FloatArray, centre: FloatArray) -> FloatArray:
    """Write the projections of contacts and centroid on the grip plane; return its normal."""
    normal, mean = fit_plane(points, centroid)
    offset = 0.0
    for a in range(3):
        offset += (centroid[a] - mean[a]) * normal[a]
    for a in range(3):
        centre[a] = centroid[a] - offset * normal[a]
    for i in range(points.shape[0]):
        height = 0.0
        for a in range(3):
            height += (points[i, a] - mean[a]) * normal[a]
        for a in range(3):
            flat[i, a] = points[i, a] - height * normal[a]
    return normal


@njit(cache=True, nogil=True)
def _potential(points: FloatArray, centroid: FloatArray, k: FloatArray, radius: float) -> float:
    n_f = points.shape[0]
    flat, centre = np.empty((n_f, 3)), np.empty(3)
    normal = _flatten(points, centroid, flat, centre)
    angles = np.empty(n_f)
    next_angles(flat, centre, normal, angles)
    value = 0.0
    for a in range(3):
        value += 0.5 * n_f * k[1] * (centroid[a] - centre[a]) ** 2
    for i in range(n_f):
        square = 0.0
        for a in range(3):
            value += 0.5 * k[0] * (points[i, a] - flat[i, a]) ** 2
            square += (flat[i, a] - centre[a]) ** 2
        error = angles[i] - 2.0 * np.pi / n_f
        value += 0.25 * radius * k[2] * error * error - k[3] * np.sqrt(square)
    return value


@njit(cache=True, nogil=True)
def _propose(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    barrier: FloatArray,
    barrier_force: FloatArray,
    k: FloatArray,
    sigma_f: float,
    thorough: bool,
    vertices: IntArray,
) -> bool:
    """Write the next vertices and return True, or return False at a local optimum."""
    n_f, width = moves.shape
    radius = _mean_radius(nodes_points, centroid)
    points = np.empty((n_f, 3))
    for i in range(n_f):
        for a in range(3):
            points[i, a] = nodes_points[vertices[i], a]
    walls = _barrier_potential(nodes_points, moves, barrier)
    here = _potential(points, centroid, k, radius)
    # Values below this are rounding, not progress.
    least = 1e-9 * (abs(here) + k[3] * radius)
    for i in range(n_f):
        here += walls[i, 0]

    order = _preferred_moves(
        nodes_points, nodes_normals, centroid, moves, barrier_force, k, sigma_f, points, vertices
    )
    if _try_together(nodes_points, centroid, moves, walls, k, radius, order, here - least, points, vertices):
        return True
    if _try_alone(nodes_points, centroid, moves, walls, k, radius, order, here - least, points, vertices):
        return True
    if not thorough or width < 2:
        return False
    return _try_subsets(nodes_points, centroid, moves, walls, k, radius, here - least, vertices)


@njit(cache=True, nogil=True)
def _barrier_potential(nodes_points: FloatArray, moves: IntArray, barrier: FloatArray) -> FloatArray:
    """Return the barrier's share of the potential at every move: its value times the contour's spacing."""
    n_f, width = moves.shape
    walls = np.zeros((n_f, width))
    for i in range(n_f):
        spacing, count = 0.0, 0
        for c in range(1, width):
            if moves[i, c] >= 0:
                square = 0.0
                for a in range(3):
                    square += (nodes_points[moves[i, c], a] - nodes_points[moves[i, 0], a]) ** 2
                spacing += np.sqrt(square)
                count += 1
        for c in range(width):
            walls[i, c] = barrier[i, c] * spacing / max(count, 1)
    return walls


@njit(cache=True, nogil=True)
def _preferred_moves(
    nodes_points: FloatArray,
    nodes_normals: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    barrier_force: FloatArray,
    k: FloatArray,
    sigma_f: float,
    points: FloatArray,
    vertices: IntArray,
) -> IntArray:
    """Return each contact's moves along its projected force, best aligned first, -1 after the last."""
    n_f, width = moves.shape
    terms = np.zeros((4, n_f, 3))
    _field(points, centroid, k, terms)
    order = np.full((n_f, width), -1, dtype=np.int64)
    cosines = np.empty(width)
    force = np.empty(3)
    for i in range(n_f):
        normal_part = 0.0
        for a in range(3):
            force[a] = terms[0, i, a] + terms[1, i, a] + terms[2, i, a] + terms[3, i, a] + barrier_force[i, a]
            normal_part += force[a] * nodes_normals[vertices[i], a]
        size = 0.0
        for a in range(3):
            force[a] -= normal_part * nodes_normals[vertices[i], a]
            size += force[a] ** 2
        size = np.sqrt(size)
        if size <= sigma_f:
            continue
        for c in range(width):
            cosines[c] = 0.0
            if c == 0 or moves[i, c] < 0:
                continue
            along, length, rise = 0.0, 0.0, 0.0
            for a in range(3):
                step = nodes_points[moves[i, c], a] - points[i, a]
                along += step * force[a]
                length += step * step
                rise += step * nodes_normals[vertices[i], a]
            length -= rise * rise
            if length > 0.0:
                cosines[c] = along / (np.sqrt(length) * size)
        for rank in range(width):
            best = 0
            for c in range(1, width):
                if cosines[c] > cosines[best]:
                    best = c
            if cosines[best] <= 1e-9:
                break
            order[i, rank] = best
            cosines[best] = 0.0
    return order


@njit(cache=True, nogil=True)
def _distinct(vertices: IntArray) -> bool:
    for i in range(len(vertices)):
        for j in range(i):
            if vertices[i] == vertices[j]:
                return False
    return True


@njit(cache=True, nogil=True)
def _try_together(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    order: IntArray,
    below: float,
    points: FloatArray,
    vertices: IntArray,
) -> bool:
    """Move every contact to the neighbour closest to its force, if that lowers the potential."""
    n_f = len(vertices)
    chosen = vertices.copy()
    moved = points.copy()
    value, any_moves = 0.0, False
    for i in range(n_f):
        column = 0
        if order[i, 0] > 0:
            column, any_moves = order[i, 0], True
        chosen[i] = moves[i, column]
        for a in range(3):
            moved[i, a] = nodes_points[chosen[i], a]
        value += walls[i, column]
    if not any_moves or not _distinct(chosen):
        return False
    if value + _potential(moved, centroid, k, radius) >= below:
        return False
    for i in range(n_f):
        vertices[i] = chosen[i]
    return True


@njit(cache=True, nogil=True)
def _try_alone(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    order: IntArray,
    below: float,
    points: FloatArray,
    vertices: IntArray,
) -> bool:
    """Move the one contact whose first useful move along its force lowers the potential most."""
    n_f, width = moves.shape
    standing = 0.0
    for i in range(n_f):
        standing += walls[i, 0]
    best, best_finger, best_node = below, -1, -1
    chosen = vertices.copy()
    moved = points.copy()
    for i in range(n_f):
        for rank in range(width):
            column = order[i, rank]
            if column < 0:
                break
            chosen[i] = moves[i, column]
            for a in range(3):
                moved[i, a] = nodes_points[chosen[i], a]
            value = standing - walls[i, 0] + walls[i, column] + _potential(moved, centroid, k, radius)
            if value < below and _distinct(chosen):
                if value < best:
                    best, best_finger, best_node = value, i, chosen[i]
                break
        chosen[i] = vertices[i]
        for a in range(3):
            moved[i, a] = points[i, a]
    if best_finger < 0:
        return False
    vertices[best_finger] = best_node
    return True


@njit(cache=True, nogil=True)
def _try_subset(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    below: float,
    fingers: IntArray,
    vertices: IntArray,
    found: IntArray,
) -> float:
    """Write the best positions of a subset of contacts on their contours; return its potential, or ``below``."""
    width = moves.shape[1]
    standing = 0.0
    points = np.empty((len(vertices), 3))
    chosen = vertices.copy()
    for i in range(len(vertices)):
        standing += walls[i, 0]
        for a in range(3):
            points[i, a] = nodes_points[vertices[i], a]
    for i in fingers:
        standing -= walls[i, 0]
    best = below
    for combination in range(width ** len(fingers)):
        rest, value, allowed = combination, standing, True
        for i in fingers:
            column = rest % width
            rest //= width
            node = moves[i, column]
            if node < 0:
                allowed = False
                break
            value += walls[i, column]
            chosen[i] = node
            for a in range(3):
                points[i, a] = nodes_points[node, a]
        if not allowed or not _distinct(chosen):
            continue
        value += _potential(points, centroid, k, radius)
        if value < best:
            best = value
            for i in range(len(vertices)):
                found[i] = chosen[i]
    return best


@njit(cache=True, nogil=True)
def _try_subsets(
    nodes_points: FloatArray,
    centroid: FloatArray,
    moves: IntArray,
    walls: FloatArray,
    k: FloatArray,
    radius: float,
    below: float,
    vertices: IntArray,
) -> bool:
    """Move the two contacts that lower the potential most; if none do, all three of three."""
    n_f = len(vertices)
    best, found = below, vertices.copy()
    fingers = np.empty(2, dtype=np.int64)
    for i in range(n_f):
        for j in range(i + 1, n_f):
            fingers[0], fingers[1] = i, j
            best = _try_subset(nodes_points, centroid, moves, walls, k, radius, best, fingers, vertices, found)
    # With more fingers triples cost too much for what they find.
    if best >= below and n_f == 3 and moves.shape[1] <= 9:
        best = _try_subset(
            nodes_points, centroid, moves, walls, k, radius, best, np.arange(3), vertices, found
        )
    if best >= below:
        return False
    for i in range(n_f):
        vertices[i] = found[i]
    return True
