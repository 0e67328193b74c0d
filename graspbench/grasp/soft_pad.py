"""Soft finger pads: a contact patch that grows with the load, and the friction that it can bear.

A pad under the normal force N touches over a disc of radius a = c N^g with g <= 1/3 (Xydas and Kao 1999;
g = 1/3 is Hertz's linear elastic sphere, g = 0 a patch that does not grow). Coulomb's law on the disc bounds
the tangential force by mu N and the torque about the normal by e N, with e in proportion to mu a; between the
two lies the limit surface, here the ellipsoid |f_t|^2 / mu^2 + tau^2 / e^2 <= N^2 (Howe and Cutkosky 1996).
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from pydantic import Field

_MINDLIN = (
    2.0 / 3.0
)  # sideways and turning stiffness over the normal one, of a material that keeps its volume


@dataclass(frozen=True)
class PadParameters:
    """A soft finger pad."""

    radius_m: Annotated[float, Field(gt=0, description="Radius c of the contact patch under 1 N, m")] = 0.0025
    exponent: Annotated[
        float, Field(ge=0, le=1 / 3, description="Growth g of the patch, radius c N^g; 1/3: linear elastic")
    ] = 1 / 3
    pressure_exponent: Annotated[
        float,
        Field(
            ge=1,
            le=1000,
            description="Shape k of the pressure (1 - (r/a)^k)^(1/k); 2: Hertz, large: uniform",
        ),
    ] = 2.0
    load_n: Annotated[
        float, Field(gt=0, description="Normal force of a finger at which grasps are measured, N")
    ] = 5.0

    def patch_radius_m(self, normal_n: float) -> float:
        """Return the radius of the contact patch under a normal force, N."""
        return float(self.radius_m * max(normal_n, 0.0) ** self.exponent)

    def torsion_m(self, normal_n: float, friction: float) -> float:
        """Return e: the largest torque about the normal per normal force, m, at that normal force."""
        return friction * self.lever * self.patch_radius_m(normal_n)

    @property
    def lever(self) -> float:
        """Mean distance of the pressure from the patch's centre, in patch radii.

        It is the ratio of the integrals of x^2 p and x p over 0 < x < 1, two beta functions: 3 pi / 16 for
        Hertz's pressure, 2 / 3 for a uniform one.
        """
        k = self.pressure_exponent
        return math.exp(_log_beta(3.0 / k, 1.0 / k + 1.0) - _log_beta(2.0 / k, 1.0 / k + 1.0))

    def yielding(self, normal_n: float, tip_radius_m: float) -> "PadYielding":
        """Return how far a pad on a sphere gives way under a normal force, and how stiff it is then.

        The indentation is Hertz's, a^2 / R; the other stiffnesses are Mindlin's for a material that keeps its
        volume: 2/3 of the normal one sideways, 2/3 a^2 of it about the normal.

        Args:
            normal_n: Normal force, N, positive.
            tip_radius_m: Radius R of the unloaded tip, m.
        """
        radius, g = self.patch_radius_m(normal_n), max(self.exponent, 1e-3)
        indentation = radius**2 / tip_radius_m
        normal = normal_n / (2.0 * g * indentation)
        return PadYielding(indentation, normal, _MINDLIN * normal, _MINDLIN * normal * radius**2)


class PadYielding(NamedTuple):
    """A pad under load.

    Attributes:
        indentation_m: How much nearer the tip's centre is to the surface than unloaded.
        normal_n_per_m: Stiffness along the normal at this load.
        sideways_n_per_m: Stiffness along the surface.
        turning_nm_rad: Stiffness about the normal.
    """

    indentation_m: float
    normal_n_per_m: float
    sideways_n_per_m: float
    turning_nm_rad: float


def limit_use(
    sideways_n: float, torque_nm: float, normal_n: float, friction: float, torsion_m: float
) -> float:
    """Return the share of the friction that a contact uses: 1 on the limit surface, less inside.

    Args:
        sideways_n: Tangential force.
        torque_nm: Torque about the normal.
        normal_n: Normal force, positive.
        friction: Friction coefficient mu.
        torsion_m: e, torque per normal force.
    """
    return math.hypot(sideways_n / friction, torque_nm / torsion_m) / normal_n


def _log_beta(p: float, q: float) -> float:
    return math.lgamma(p) + math.lgamma(q) - math.lgamma(p + q)
