"""Friction of contacts that slide: on the limit surface, against the motion (maximum dissipation).

Of all frictions within |f|^2 / mu^2 + tau^2 / e^2 <= N^2 a sliding contact has the one that takes the most
power out of the motion, so that the sliding twist is along the limit surface's normal there (Goyal, Ruina and
Papadopoulos 1991).
"""

import math
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray


class Sliding(NamedTuple):
    """How a finger slides over the object.

    Attributes:
        velocity: Of the fingertip over the object's surface, tangential, shape (2,) or (3,), m/s.
        spin_rad_s: Of the fingertip against the object about the outward normal.
    """

    velocity: FloatArray
    spin_rad_s: float = 0.0


class Friction(NamedTuple):
    """Friction of the finger on the object.

    Attributes:
        force: Tangential, axes as of the velocity, N.
        torque_nm: About the outward normal.
    """

    force: FloatArray
    torque_nm: float


def sliding_friction(sliding: Sliding, normal_n: float, friction: float, torsion_m: float = 0.0) -> Friction:
    """Return the friction by which a sliding finger drags the object along.

    Args:
        sliding: How it slides, in any scale: friction does not depend on the speed.
        normal_n: Normal force.
        friction: Coulomb friction coefficient mu, positive.
        torsion_m: Torque about the normal per normal force e; 0 for a point.

    Raises:
        ValueError: It does not slide.
    """
    velocity = np.asarray(sliding.velocity, dtype=np.float64)
    power = math.hypot(friction * float(np.linalg.norm(velocity)), torsion_m * sliding.spin_rad_s)
    if power <= 0.0:
        raise ValueError("a contact that slides has a velocity along the surface or about its normal")
    force: FloatArray = friction**2 * normal_n / power * velocity
    return Friction(force, torsion_m**2 * normal_n / power * sliding.spin_rad_s)


def sliding_direction(found: Friction, friction: float, torsion_m: float = 0.0) -> Sliding:
    """Return how a finger slides, in some scale, when its friction on the object is on the limit surface.

    The inverse of `sliding_friction`: the limit surface's normal. A point, e = 0, bears no torque and has no
    preferred spin.
    """
    spin = 0.0 if torsion_m == 0.0 else found.torque_nm / torsion_m**2
    return Sliding(np.asarray(found.force) / friction**2, spin)
