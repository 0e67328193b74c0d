"""How a planned grasp is executed, and what came of it."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from graspbench.arrays import FloatArray


@dataclass(frozen=True)
class ExecutionParameters:
    """Execution of the planned grasp in the physics simulation."""

    until: Annotated[
        Literal["off", "contact", "hold", "pushes", "shakes"],
        Field(
            description="Last phase: off; contact; hold (squeeze, lift, hold, wrist rotation); pushes; shakes"
        ),
    ] = "hold"
    mount: Annotated[
        Literal["floating", "kuka"],
        Field(description="What carries the hand: a floating wrist, or the flange of a KUKA LBR iiwa 14"),
    ] = "floating"
    time_step_s: Annotated[float, Field(gt=0, le=0.005, description="Physics time step, s")] = 0.002
    solver_iterations: Annotated[int, Field(ge=10, description="Constraint solver iterations a step")] = 60
    friction: Annotated[
        float,
        Field(gt=0, description="Coulomb friction between fingertips and object; as in quality.friction"),
    ] = 0.5
    torsional_friction_m: Annotated[
        float, Field(ge=0, description="Torque about the contact normal per normal force (soft tip), m")
    ] = 0.002
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
    shake_amplitude_m: Annotated[
        float, Field(gt=0, description="Amplitude of the wrist's shakes along x, y and z, m")
    ] = 0.02
    shake_frequency_hz: Annotated[
        float, Field(gt=0, description="Frequency of the shakes, Hz; the peak is (2 pi f)^2 amplitude")
    ] = 4.0
    shake_time_s: Annotated[float, Field(gt=0, description="Duration of the shake along an axis, s")] = 1.0


@dataclass(frozen=True)
class Motion:
    """Samples of what happened, for the record.

    Attributes:
        times_s: Times since the start, shape (t,).
        joints: Joint positions, shape (t, n_q).
        transform_palm_to_world: Poses of the palm, shape (t, 4, 4).
        transform_object_to_world: Poses of the object, shape (t, 4, 4).
    """

    times_s: FloatArray
    joints: FloatArray
    transform_palm_to_world: FloatArray
    transform_object_to_world: FloatArray


@dataclass(frozen=True)
class PhaseOutcome:
    """How one phase ended.

    Attributes:
        name: squeeze, lift, hold, rotate, hold_rotated, shake_x, shake_y or shake_z.
        contacts: Number of fingers in touch at its end.
        contacts_lost: Most fingers out of touch at any time in it.
        slip_m: Net sliding, since the end of the squeeze, at the contact that slid farthest.
        drift_m: Drift of the object's centre in the palm frame since then.
        turn_deg: Rotation of the object in the palm frame since then.
        load_weight: Largest force that the motion asked for at the object's centre, multiples of its weight.
        held: Whether the object was still in the hand.
    """

    name: str
    contacts: int
    contacts_lost: int
    slip_m: float
    drift_m: float
    turn_deg: float
    load_weight: float
    held: bool


@dataclass(frozen=True)
class ExecutionResult:
    """What came of a planned grasp.

    Attributes:
        success: Whether every phase asked for ended well: contact by all fingers, and, beyond that, the
            object held to the end with a drift below ``slip_limit_m``.
        reason: Why not, one clause; None on success.
        fingers: Number of fingers that should touch.
        contacts_made: Number of fingers that touched by the end of the closing.
        contact_time_s: When each finger touched, nan if it did not.
        contact_error_m: Distance of each real contact from the planned one, nan if there is none.
        tip_error_max_m: Largest distance of a fingertip from its planned path before it touched.
        palm_error_max_m: Largest distance of the palm from where it was wanted, at any sample.
        object_displacement_m: How far the object's centre was moved until the end of the closing.
        object_turn_deg: How far it was turned until then.
        grip_force_n: Mean normal force asked of a finger, 0 if it came to no squeeze.
        phases: Outcomes of the phases after the contact.
        pushes_weight: Largest push resisted along +x, -x, +y, -y, +z, -z of the world, multiples of the
            weight; None if not asked for.
        time_s: Simulated time.
        motion: Samples for the record.
    """

    success: bool
    reason: str | None
    fingers: int
    contacts_made: int
    contact_time_s: tuple[float, ...]
    contact_error_m: tuple[float, ...]
    tip_error_max_m: float
    palm_error_max_m: float
    object_displacement_m: float
    object_turn_deg: float
    grip_force_n: float
    phases: tuple[PhaseOutcome, ...]
    pushes_weight: tuple[float, ...] | None
    time_s: float
    motion: Motion

    @property
    def largest_push_weight(self) -> float | None:
        """Push resisted in the weakest of the six directions, multiples of the weight."""
        return None if self.pushes_weight is None else min(self.pushes_weight)
