"""What came of a planned grasp in physics."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from graspbench.arrays import FloatArray

if TYPE_CHECKING:
    from graspbench.simulation.exploration import Exploration


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
class StepOutcome:
    """Answers to one kind of step, along the palm's x, y and z.

    Attributes:
        error: Root mean square distance from the controller's model over the step, of the worst axis; None
            where the controller has no model.
        end: Where the object is when time is up, over the step: of the axis that is farthest from 1. For a
            force without a model the displacement over 1 mm.
        overshoot: Largest excess over the end, as a share of the end, of the worst axis.
        rise_time_s: Until 63 % of the end is reached, of the slowest axis.
    """

    error: float | None
    end: float
    overshoot: float
    rise_time_s: float


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
        friction: Coulomb coefficient between fingertips and object.
        torsional_friction_m: Torque about the contact normal per normal force, m.
        planned_friction: Coulomb coefficient that the grasp was planned with.
        grip_force_n: Mean normal force asked of a finger, 0 if it came to no squeeze.
        phases: Outcomes of the phases after the contact.
        pushes_weight: Largest push resisted along +x, -x, +y, -y, +z, -z of the world, multiples of the
            weight; None if not asked for.
        twists_nm: Largest torque resisted about the same axes; None if not asked for.
        time_s: Simulated time.
        motion: Samples for the record.
        explored: What exploring touches found; None without any.
        contacts: Where each finger touched first and the normal there, INTO the object, in the object's frame
            after the last touch, shape (n_f, 2, 3); None unless all did.
        steps: Answers of the held object to a step of its goal ("goal") and of a force on it ("force").
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
    friction: float
    torsional_friction_m: float
    planned_friction: float
    grip_force_n: float
    phases: tuple[PhaseOutcome, ...]
    pushes_weight: tuple[float, ...] | None
    twists_nm: tuple[float, ...] | None
    time_s: float
    motion: Motion
    explored: "Exploration | None" = None
    contacts: FloatArray | None = None
    steps: Mapping[str, StepOutcome] = field(default_factory=dict)

    @property
    def largest_push_weight(self) -> float | None:
        """Push resisted in the weakest of the six directions, multiples of the weight."""
        return None if self.pushes_weight is None else min(self.pushes_weight)

    @property
    def largest_twist_nm(self) -> float | None:
        """Torque resisted about the weakest of the six axes."""
        return None if self.twists_nm is None else min(self.twists_nm)
