"""The friction between fingertips and object: what was planned with, unless it is set apart on purpose."""

from dataclasses import dataclass

from graspbench.grasp.quality import QualityParameters
from graspbench.grasp.soft_pad import PadParameters
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
        pad: Soft pads, whose torque per normal force follows the load; `torsional_m` is then that under the
            load that grasps are measured at. None for others.
    """

    coulomb: float
    torsional_m: float
    planned: float
    pad: PadParameters | None = None


def tip_friction(
    parameters: ExecutionParameters,
    quality: QualityParameters,
    surface: Surface,
    soft_torsion_m: float | None = None,
    pad: PadParameters | None = None,
) -> TipFriction:
    """Return the friction that a grasp is executed with.

    Args:
        parameters: ``execution.friction`` and ``torsional_friction_m``, where they are set.
        quality: What the grasp was planned with; a soft finger's torsion and a soft pad count.
        surface: The surface that it was planned on; it gives the torque length.
        soft_torsion_m: What an in-hand motion with soft contacts was planned with.
        pad: The pads that an in-hand motion with soft pads was planned with.
    """
    coulomb, torsional = parameters.friction, parameters.torsional_friction_m
    if coulomb is None:
        coulomb = quality.friction
    if torsional is None:
        torsional = soft_torsion_m
    if pad is None and quality.contact == "soft_pad":
        pad = quality.pad
    if torsional is None and pad is not None:
        return TipFriction(coulomb, pad.torsion_m(pad.load_n, coulomb), quality.friction, pad)
    if torsional is None and quality.contact == "soft_finger":
        length_m = quality.torque_length_m(surface.points, surface.centroid)
        torsional = quality.torsional_friction * length_m
    return TipFriction(coulomb, _TORSION_M if torsional is None else torsional, quality.friction)
