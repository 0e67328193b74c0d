"""What drives the fingers while they grip, and its parameters."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

ControlName = Literal["joint_impedance", "object_impedance", "computed_torque", "hybrid"]


@dataclass(frozen=True)
class ObjectImpedanceParameters:
    """Mass, damper and spring that the held object shall be, in translation and in rotation."""

    mass_kg: Annotated[float, Field(gt=0, description="Mass that a push on the object feels, kg")] = 0.5
    damping_ns_per_m: Annotated[float, Field(ge=0, description="Damping to the goal's motion, N s/m")] = 20.0
    stiffness_n_per_m: Annotated[float, Field(gt=0, description="Stiffness to the goal's place, N/m")] = 400.0
    inertia_kgm2: Annotated[
        float, Field(gt=0, description="Moment of inertia that a torque on it feels, kg m^2")
    ] = 5e-4
    turning_damping_nms_rad: Annotated[
        float, Field(ge=0, description="Damping to the goal's rotation, N m s/rad")
    ] = 0.02
    turning_stiffness_nm_rad: Annotated[
        float, Field(gt=0, description="Stiffness to the goal's orientation, N m/rad")
    ] = 0.4
    feels_wrench: Annotated[
        bool,
        Field(
            description="Feel what acts on the object, from its motion and the fingertips' forces; otherwise "
            "it answers with its own mass and the fingers'"
        ),
    ] = True
    observer_time_s: Annotated[
        float,
        Field(ge=0, description="Time in which contact friction that no model has is made up for, s; 0: not"),
    ] = 0.009
    following_rad_s: Annotated[
        float,
        Field(
            ge=0,
            description="How fast the object is led to the oscillator that the felt forces drive, rad/s; "
            "0: not",
        ),
    ] = 60.0


@dataclass(frozen=True)
class ComputedTorqueParameters:
    """Feedback of the object's pose error under feedback linearisation."""

    bandwidth_rad_s: Annotated[
        float, Field(gt=0, description="Natural frequency of the pose error, rad/s")
    ] = 40.0
    damping_ratio: Annotated[float, Field(ge=0, description="Damping ratio of the pose error")] = 1.0
    integral_rate_hz: Annotated[
        float, Field(ge=0, description="Rate at which a lasting error is integrated away, 1/s; 0: it stays")
    ] = 5.0


@dataclass(frozen=True)
class HybridParameters:
    """Every finger by itself: force along the contact normal, place along the surface."""

    stiffness_n_per_m: Annotated[float, Field(ge=0, description="Stiffness along the surface, N/m")] = 600.0
    damping_ns_per_m: Annotated[float, Field(ge=0, description="Damping along the surface, N s/m")] = 3.0
    force_integral_hz: Annotated[
        float, Field(ge=0, description="Rate at which an error of the normal force is integrated away, 1/s")
    ] = 5.0
