"""A finger's contact with the object, as the physics feels it."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray


@dataclass(frozen=True)
class Touch:
    """One finger's contact with the object.

    Attributes:
        force_n: Sum of the normal forces.
        point: Their centre of pressure in the world, shape (3,).
        normal: Mean direction of the normals, pointing INTO the object, shape (3,).
        by_tip: Whether the fingertip itself touches, not only a link behind it.
    """

    force_n: float
    point: FloatArray
    normal: FloatArray
    by_tip: bool


def touch_of(
    parts: list[tuple[float, tuple[float, ...], tuple[float, ...], bool]], least_force_n: float
) -> Touch | None:
    """Return a finger's contact from those of its links; None where the force is too small.

    Args:
        parts: Normal force, point, normal into the object, and whether the tip touches, of each contact.
        least_force_n: Least sum of the normal forces.
    """
    if not parts:
        return None
    tips = [part for part in parts if part[3]]
    use = tips or parts
    forces = np.array([part[0] for part in use])
    total = float(forces.sum())
    if total < least_force_n:
        return None
    normal = forces @ np.array([part[2] for part in use])
    normal /= max(float(np.linalg.norm(normal)), 1e-12)
    return Touch(total, forces @ np.array([part[1] for part in use]) / total, normal, bool(tips))
