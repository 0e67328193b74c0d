"""How a planned grasp is executed."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from graspbench.simulation.control_parameters import (
    ComputedTorqueParameters,
    ControlName,
    HybridParameters,
    ObjectImpedanceParameters,
)
from graspbench.simulation.touch_parameters import TouchParameters


@dataclass(frozen=True)
class ExecutionParameters:
    """Execution of the planned grasp in the physics simulation."""

    until: Annotated[
        Literal["off", "contact", "hold", "pushes", "shakes"],
        Field(
            description="Last phase: off; contact; hold (squeeze, lift, hold, wrist rotation); pushes; shakes"
        ),
    ] = "hold"
    control: Annotated[
        ControlName,
        Field(
            description="What drives the fingers once the object is squeezed: joint_impedance, "
            "object_impedance, computed_torque or hybrid (force along the normals, place along the surface)"
        ),
    ] = "joint_impedance"
    object_impedance: Annotated[
        ObjectImpedanceParameters, Field(description="What the held object shall be under object_impedance")
    ] = field(default_factory=ObjectImpedanceParameters)
    computed_torque: Annotated[ComputedTorqueParameters, Field(description="Gains of computed_torque")] = (
        field(default_factory=ComputedTorqueParameters)
    )
    hybrid: Annotated[HybridParameters, Field(description="Gains of hybrid")] = field(
        default_factory=HybridParameters
    )
    step_m: Annotated[
        float, Field(ge=0, le=0.02, description="Step of the held object's goal that is tried, m; 0: none is")
    ] = 0.0
    step_force_n: Annotated[
        float, Field(ge=0, description="Step of a force on the held object that is tried, N; 0: none is")
    ] = 0.0
    step_time_s: Annotated[float, Field(gt=0, description="How long the answer to a step is watched, s")] = (
        0.4
    )
    time_step_s: Annotated[float, Field(gt=0, le=0.005, description="Physics time step, s")] = 0.002
    solver_iterations: Annotated[
        int, Field(ge=10, le=1000, description="Constraint solver iterations a step")
    ] = 60
    friction: Annotated[
        float | None,
        Field(gt=0, description="Coulomb friction between fingertips and object; null: quality.friction"),
    ] = None
    torsional_friction_m: Annotated[
        float | None,
        Field(
            ge=0,
            description="Torque about the contact normal per normal force, m; null: as soft fingers were "
            "planned with, 2 mm where others were planned",
        ),
    ] = None
    contact_force_n: Annotated[
        float, Field(gt=0, description="Least normal force that counts as touch, N")
    ] = 0.05
    closing_speed_m_s: Annotated[
        float, Field(gt=0, description="Fingertip speed while closing beyond the planned contacts, m/s")
    ] = 0.03
    closing_distance_m: Annotated[
        float, Field(ge=0, description="Farthest way beyond the planned contacts before giving up, m")
    ] = 0.015
    grip_force_n: Annotated[
        float, Field(gt=0, description="Least mean normal force a finger squeezes with, N")
    ] = 5.0
    grip_safety: Annotated[
        float,
        Field(
            gt=0, description="Normal forces add up to this many times what carries the weight by friction"
        ),
    ] = 4.0
    payload_safety: Annotated[
        float,
        Field(
            ge=0,
            description="Objects whose weight times this is more than joints and friction can carry with the "
            "planned grasp at best are planned for again, and not lifted when no grasp carries them; 0: all "
            "are tried as planned",
        ),
    ] = 1.5
    strengthen_below: Annotated[
        float,
        Field(
            ge=0,
            lt=1,
            description="A grasp whose contacts keep a smaller share of their friction when the fingers "
            "squeeze climbs Q3 before it is executed; 0: every grasp is executed as planned",
        ),
    ] = 0.45
    strengthen_below_q3: Annotated[
        float,
        Field(
            ge=0,
            description="So does a grasp whose Q3 is smaller, of an object that the hand carries with ease; "
            "0: Q3 is no reason",
        ),
    ] = 0.2
    steady_share: Annotated[
        float,
        Field(
            gt=0, description="grip_force_n counts up to this share of what the fingers' springs keep steady"
        ),
    ] = 0.2
    slip_response: Annotated[
        float,
        Field(
            ge=0, le=10, description="Share by which the grip gets firmer per 0.1 mm of felt sliding; 0: none"
        ),
    ] = 0.0
    slip_force_limit_n: Annotated[
        float, Field(gt=0, description="Mean normal force up to which felt sliding makes the grip firmer, N")
    ] = 20.0
    squeeze_time_s: Annotated[float, Field(gt=0, description="Time in which the grip force builds up, s")] = (
        0.4
    )
    stiffness_nm_rad: Annotated[float, Field(ge=0, description="Joint stiffness while gripping, N m/rad")] = (
        10.0
    )
    damping_nms_rad: Annotated[float, Field(ge=0, description="Joint damping while gripping, N m s/rad")] = (
        0.2
    )
    lift_height_m: Annotated[float, Field(gt=0, description="Height of the lift, m")] = 0.20
    lift_time_s: Annotated[float, Field(gt=0, description="Duration of the lift, s")] = 1.0
    hold_time_s: Annotated[float, Field(gt=0, description="Duration of each hold, s")] = 0.5
    rotation_deg: Annotated[
        float, Field(ge=0, le=180, description="Tilt of the wrist after the hold, deg")
    ] = 90.0
    rotation_time_s: Annotated[float, Field(gt=0, description="Duration of the tilt, s")] = 1.5
    slip_limit_m: Annotated[
        float,
        Field(gt=0, description="Drift of the object in the hand after the squeeze that counts as lost, m"),
    ] = 0.02
    push_limit: Annotated[float, Field(gt=0, description="Strongest push tried, multiples of the weight")] = (
        10.0
    )
    push_time_s: Annotated[float, Field(gt=0, description="Time in which a push grows to its limit, s")] = 1.0
    push_slip_m: Annotated[float, Field(gt=0, description="Net sliding at a contact that ends a push, m")] = (
        0.002
    )
    twist_limit_nm: Annotated[
        float, Field(ge=0, description="Largest torque tried after the pushes, N m; 0: none are")
    ] = 0.0
    twist_slip_deg: Annotated[
        float, Field(gt=0, description="Turn of the object in the hand that ends a torque, deg")
    ] = 10.0
    shake_amplitude_m: Annotated[
        float, Field(gt=0, description="Amplitude of the wrist's shakes along x, y and z, m")
    ] = 0.02
    shake_frequency_hz: Annotated[
        float, Field(gt=0, description="Frequency of the shakes, Hz; the peak is (2 pi f)^2 amplitude")
    ] = 4.0
    shake_time_s: Annotated[float, Field(gt=0, description="Duration of the shake along an axis, s")] = 1.0
    touch: Annotated[TouchParameters, Field(description="Exploring touches before the grasp")] = field(
        default_factory=TouchParameters
    )
