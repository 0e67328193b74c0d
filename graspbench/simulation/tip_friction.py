"""The friction between fingertips and object: what was planned with, unless it is set apart on purpose."""

from dataclasses import dataclass

from graspbench.grasp.quality import QualityParameters
from graspbench.reconstruction.surface import Surface
from graspbench.simulation.execution_parameters import ExecutionParameters

# Of a fingertip that was planned as a point: real ones are a little soft.
_TORSION_M = 0.002


@dataclass(frozen=True)
class TipFriction:
    """Friction between fingertips and object.

    Attributes:
        coulomb: Coulomb coefficient in the execution.
        torsional_m: Largest torque about the contact normal per normal force there, m.
        planned: Coulomb coefficient that the grasp was planned and scored with.
    """

    coulomb: float
    torsional_m: float
    planned: float


def tip_friction(
    parameters: ExecutionParameters,
    quality: QualityParameters,
    surface: Surface,
    soft_torsion_m: float | None = None,
) -> TipFriction:
    """Return the friction that a grasp is executed with.

    Args:
        parameters: ``execution.friction`` and ``torsional_friction_m``, where they are set.
        quality: What the grasp was planned with; a soft finger's torsion counts.
        surface: The surface that it was planned on; it gives the torque length.
        soft_torsion_m: What an in-hand motion with soft contacts was planned with.
    """
    coulomb, torsional = parameters.friction, parameters.torsional_friction_m
    if coulomb is None:
        coulomb = quality.friction
    if torsional is None:
        torsional = soft_torsion_m
    if torsional is None and quality.contact == "soft_finger":
        length_m = quality.torque_length_m(surface.points, surface.centroid)
        torsional = quality.torsional_friction * length_m
    return TipFriction(coulomb, _TORSION_M if torsional is None else torsional, quality.friction)
