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

with d_i, r_i the contact's distances from the plane and, in it, from c^PI; h the centroid's distance from
the plane; e_i the angle's error; r the surface's mean radius; b_i the barrier value and s_i the contour's
mean spacing. So the planner cannot cycle, and a local optimum is a stable one. While the surface still
moves, single contacts move; once it is at rest, up to three contacts may move together, which gets the
grasp out of places where the plane can only be shifted by several fingers at once.

What moves a grasp at rest, and what it is scored by, is `rest`: with "balance" (the default, not in the
thesis) the contacts move, one or two at a time, to where less is left of each projected force: see
`graspbench.planning.balance`. With "potential" they lower the potential, one to three at a time. With
"single" one contact at a time moves along its force, as in the thesis.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.planning.balance import propose_balance
from graspbench.planning.field import field, mean_radius, potential
from graspbench.planning.field_climb import climb_field, field_values
from graspbench.planning.field_moves import barrier_potential, propose_moves
from graspbench.planning.index import INDICES, Climbs, Moves
from graspbench.reconstruction.surface import Surface

if TYPE_CHECKING:
    from graspbench.grasp.quality import QualityParameters

_K_R, _K_N = 3.0, 1.0
_NO_BALANCE = np.empty(0)


@dataclass(frozen=True)
class ForceFieldParameters:
    """Coefficients of the force field (thesis 3.4.2)."""

    k_pi: Annotated[
        float, Field(ge=0, description="Pull of the contacts onto one plane, N per unit length")
    ] = 1.0
    k_cm: Annotated[
        float, Field(ge=0, description="Pull of the plane to the centroid, N per unit length; 0: off")
    ] = 1.0
    k_e: Annotated[float, Field(ge=0, description="Pull to an equilateral grasp, N per unit angle")] = 1.0
    k_a: Annotated[float, Field(ge=0, description="Push outwards, to a larger grasp polygon, N")] = 1.0
    k_b: Annotated[float, Field(ge=0, description="Weight of the kinematic barrier of the hand")] = 1.0
    sigma_f: Annotated[float, Field(ge=0, description="Tangential force below which a contact stays, N")] = (
        0.002
    )
    length_unit_m: Annotated[float, Field(gt=0, description="Distance that counts as one unit of error")] = (
        1e-3
    )
    angle_unit_deg: Annotated[float, Field(gt=0, description="Angle that counts as one unit of error")] = 1.0
    rest: Annotated[
        Literal["balance", "potential", "single"],
        Field(
            description="Moves and score at rest: towards equilibrium, down the potential with up to three "
            "contacts at once, or down it one contact at a time (the thesis)"
        ),
    ] = "balance"
    balance_length_m: Annotated[
        float, Field(gt=0, description="balance: distance that counts as much as k_a left at a contact")
    ] = 0.03
    balance_angle_deg: Annotated[
        float, Field(gt=0, description="balance: angle that counts as much as k_a left at a contact")
    ] = 60.0
    k_r: Annotated[
        float | None,
        Field(
            description="balance: what the root of the polygon's area is worth, per mean radius of the "
            "surface, N; null: 3, and 0 where quality.wrench_space leaves moments out"
        ),
    ] = None
    k_n: Annotated[
        float | None,
        Field(
            description="balance: weight of equal forces along the normals cancelling each other, N; null: "
            "1 where quality.contact is frictionless, else 0"
        ),
    ] = None


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
        barrier_force: Kinematic barrier of each contact before its weight k_b, shape (n_f, 3), N; None for
            none.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    terms = np.zeros((4, len(points), 3))
    field(points, np.ascontiguousarray(centroid, dtype=np.float64), _coefficients(parameters), terms)
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
    value: float = potential(
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
    centre_option: ClassVar[str] = "k_cm"

    def __init__(
        self, parameters: ForceFieldParameters, n_f: int, quality: "QualityParameters | None" = None
    ) -> None:
        if n_f < 2:
            raise ConfigurationError(
                f"the force field needs at least 2 fingers, not {n_f}", remedy="use a hand with more", n_f=n_f
            )
        self._parameters = parameters
        self._coefficients = _coefficients(parameters)
        moments = quality is None or not quality.wrench_space.endswith("_force")
        self._k_r = (_K_R if moments else 0.0) if parameters.k_r is None else parameters.k_r
        frictionless = quality is not None and quality.contact == "frictionless"
        self._k_n = (_K_N if frictionless else 0.0) if parameters.k_n is None else parameters.k_n
        self._radius: tuple[FloatArray, float] | None = None

    def propose(self, surface: Surface, vertices: IntArray, moves: Moves) -> IntArray | None:
        """Return the next vertices, or None when no allowed move lowers potential or imbalance."""
        proposed = vertices.copy()
        if surface.at_rest and self._parameters.rest == "balance":
            balanced = propose_balance(
                surface.points,
                surface.normals,
                surface.centroid,
                moves.nodes,
                moves.barrier * self._parameters.k_b,
                self._balance(surface),
                proposed,
            )
            return proposed if balanced else None
        changed = propose_moves(
            surface.points,
            surface.normals,
            surface.centroid,
            moves.nodes,
            barrier_potential(surface.points, moves.nodes, moves.barrier * self._parameters.k_b),
            moves.barrier_force * self._parameters.k_b,
            self._coefficients,
            self._parameters.sigma_f,
            self._mean_radius(surface),
            surface.at_rest and self._parameters.rest == "potential",
            proposed,
        )
        return proposed if changed else None

    def climb_all(
        self, surface: Surface, starts: IntArray, allowed: BoolArray, *, thorough: bool, max_moves: int
    ) -> Climbs:
        """Move many grasps freely over allowed nodes to local optima: ``propose`` again and again, compiled.

        Args:
            surface: The surface.
            starts: Where to start, shape (m, n_f).
            allowed: Nodes that contacts may move to, shape (n_s,).
            thorough: Whether to move as on a surface at rest.
            max_moves: Moves after which a climb stops.
        """
        paths = np.empty((len(starts) * (max_moves + 1), starts.shape[1]), dtype=np.int64)
        first = np.empty(len(starts) + 1, dtype=np.int64)
        rest, network = self._parameters.rest, surface.network
        climb_field(
            surface.points,
            surface.normals,
            surface.centroid,
            network.contour_start,
            network.contour_nodes,
            allowed,
            self._coefficients,
            self._parameters.sigma_f,
            thorough and rest == "potential",
            self._balance(surface) if thorough and rest == "balance" else _NO_BALANCE,
            np.ascontiguousarray(starts, dtype=np.int64),
            paths,
            first,
        )
        return Climbs(paths[: first[-1]].copy(), first)

    def score(self, surface: Surface, vertices: IntArray) -> float:
        """Return minus the imbalance, N; minus the potential, J, if that is what moves a grasp at rest."""
        return float(self.scores(surface, vertices[None])[0])

    def scores(self, surface: Surface, grasps: IntArray) -> FloatArray:
        """Return the score of many grasps, shape (m,), from vertices of shape (m, n_f)."""
        values = np.empty(len(grasps))
        field_values(
            surface.points,
            surface.normals,
            surface.centroid,
            self._coefficients,
            self._balance(surface) if self._parameters.rest == "balance" else _NO_BALANCE,
            np.ascontiguousarray(grasps, dtype=np.int64),
            values,
        )
        return -values

    def _balance(self, surface: Surface) -> FloatArray:
        p = self._parameters
        length, angle = p.balance_length_m, np.deg2rad(p.balance_angle_deg)
        largest = self._k_r / self._mean_radius(surface)
        return np.array([p.k_pi / length, p.k_cm / length, p.k_e / angle, p.k_a, largest, self._k_n])

    def _mean_radius(self, surface: Surface) -> float:
        """Return the surface's mean radius; that of the last surface is remembered."""
        if self._radius is None or self._radius[0] is not surface.points:
            self._radius = surface.points, mean_radius(surface.points, surface.centroid)
        return self._radius[1]


def _coefficients(parameters: ForceFieldParameters) -> FloatArray:
    """Return k_pi / l, k_cm / l, k_e / a, k_a in SI units."""
    length, angle = parameters.length_unit_m, np.deg2rad(parameters.angle_unit_deg)
    return np.array(
        [parameters.k_pi / length, parameters.k_cm / length, parameters.k_e / angle, parameters.k_a]
    )
