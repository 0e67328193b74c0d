"""What a result says of the physics: the execution of a grasp, and motions in the hand."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from graspbench.results.about import About, Number, Part

_NOT_REACHED = "the execution did not come so far"


@dataclass(frozen=True)
class PhaseResult(Part):
    """How one phase ended."""

    name: Annotated[str, About("The phase")]
    contacts: Annotated[int, About("Fingers in touch at its end")]
    contacts_lost: Annotated[int, About("Most fingers out of touch at any time in it")]
    slip_m: Annotated[Number, About("Net sliding since the squeeze at the contact that slid farthest")]
    drift_m: Annotated[Number, About("Drift of the object's centre in the palm frame since the squeeze")]
    turn_deg: Annotated[Number, About("Rotation of the object in the palm frame since the squeeze")]
    load_weight: Annotated[Number, About("Largest force that the motion asked for at the object's centre")]
    held: Annotated[bool, About("Whether the object was still in the hand")]


@dataclass(frozen=True)
class StepResult(Part):
    """How the held object answered a step along the palm's x, y and z."""

    error: Annotated[
        Number | None,
        About(
            "Root mean square distance from the controller's model over the step, worst axis",
            empty="the controller has no model",
        ),
    ]
    end: Annotated[
        Number,
        About("Where it was in the end over the step, farthest from 1; of a force without model in mm"),
    ]
    overshoot: Annotated[Number, About("Largest excess over the end, as a share of it")]
    rise_time_s: Annotated[Number, About("Until 63 % of the end, slowest axis")]


@dataclass(frozen=True, kw_only=True)
class TouchResult(Part):
    """What exploring touches found before the grasp, and what was true."""

    touches: Annotated[int, About("Touches that met the object")]
    tried: Annotated[int, About("Touches that were tried")]
    time_s: Annotated[Number, About("Simulated time that they took")]
    shift_mm: Annotated[Number, About("How far the object was found from where it was seen, at its centroid")]
    turn_deg: Annotated[Number, About("By how much it was found turned about the vertical")]
    expected_before_mm: Annotated[Number, About("Expected error of a contact's place before the touches")]
    expected_after_mm: Annotated[Number, About("The same after them")]
    pose_error_before_mm: Annotated[
        Number, About("True error of the centroid's place when the touches began")
    ]
    pose_error_after_mm: Annotated[Number, About("The same after the touches' correction")]
    turn_error_before_deg: Annotated[Number, About("True error of the orientation when the touches began")]
    turn_error_after_deg: Annotated[Number, About("The same after the touches' correction")]
    felt_error_before_mm: Annotated[
        Number | None,
        About("Mean distance from the object of the surface's nodes near felt points, pose left out"),
    ] = None
    felt_error_after_mm: Annotated[
        Number | None, About("The same of the surface that the touches corrected")
    ] = None


@dataclass(frozen=True, kw_only=True)
class ExecutedResult(Part):
    """What came of the planned grasp in the simulated world."""

    success: Annotated[bool, About("Whether every phase asked for ended well")]
    reason: Annotated[str | None, About("Why not", empty="it did")]
    fingers: Annotated[int, About("Fingers that should touch")]
    contacts_made: Annotated[int, About("Fingers that touched by the end of the closing")]
    contact_time_s: Annotated[tuple[Number, ...], About("When each finger touched")]
    contact_error_m: Annotated[
        tuple[Number, ...], About("Distance of each real contact from the planned one")
    ]
    tip_error_max_m: Annotated[Number, About("Largest distance of a fingertip from its path before touch")]
    palm_error_max_m: Annotated[Number, About("Largest distance of the palm from where it was wanted")]
    object_displacement_m: Annotated[Number, About("How far the closing moved the object's centre")]
    object_turn_deg: Annotated[Number, About("How far the closing turned the object")]
    grip_force_n: Annotated[Number, About("Mean normal force asked of a finger, 0 without a squeeze")]
    time_s: Annotated[Number, About("Simulated time")]
    friction: Annotated[
        Number | None, About("Coulomb friction between fingertips and object", empty="older result")
    ] = None
    torsional_friction_m: Annotated[
        Number | None, About("Torque about the contact normal per normal force", empty="older result")
    ] = None
    planned_friction: Annotated[
        Number | None, About("Coulomb friction that the grasp was planned with", empty="older result")
    ] = None
    phases: Annotated[
        Mapping[str, PhaseResult], About("The phases after the contact", empty=_NOT_REACHED)
    ] = field(default_factory=dict)
    steps: Annotated[
        Mapping[str, StepResult],
        About("Steps of the goal and of a force that were tried", empty=_NOT_REACHED),
    ] = field(default_factory=dict)
    pushes_weight: Annotated[
        tuple[Number, ...] | None,
        About("Largest push resisted along +x, -x, +y, -y, +z, -z", empty="no pushes were asked for"),
    ] = None
    largest_push_weight: Annotated[
        Number | None, About("Push resisted in the weakest direction", empty="no pushes were asked for")
    ] = None
    true_q3: Annotated[
        Number | None,
        About(
            "Largest ball in the wrench space of the contacts that were really made, the object's true "
            "normals and centre of mass taken; 0 if they are no force closure",
            empty="a finger did not touch; older result",
        ),
    ] = None
    touch: Annotated[
        TouchResult | None, About("Exploring touches before the grasp", empty="execution.touch is off")
    ] = None
    twists_nm: Annotated[
        tuple[Number, ...] | None,
        About("Largest torque resisted about +x, -x, +y, -y, +z, -z", empty="no torques were asked for"),
    ] = None
    largest_twist_nm: Annotated[
        Number | None, About("Torque resisted about the weakest axis", empty="no torques were asked for")
    ] = None


@dataclass(frozen=True, kw_only=True)
class MovingResult(Part):
    """How the object moved while it was looked at, and how well that was known from the images alone."""

    motion: Annotated[str, About("What carried the object: conveyor, turntable or drift")]
    images: Annotated[int, About("Time-stamped images taken, wide views included")]
    duration_s: Annotated[Number, About("From the first image to the last")]
    varies: Annotated[bool, About("Whether the estimated twist varies with time")]
    speed_m_s: Annotated[Number, About("Estimated speed of the centre at the reference time", unit="m/s")]
    true_speed_m_s: Annotated[Number, About("True speed of the same point", unit="m/s")]
    velocity_error_m_s: Annotated[Number, About("Length of the velocity's error", unit="m/s")]
    yaw_rate_deg_s: Annotated[Number, About("Estimated yaw rate at the reference time", unit="deg/s")]
    true_yaw_rate_deg_s: Annotated[Number, About("True yaw rate then", unit="deg/s")]
    yaw_rate_error_deg_s: Annotated[
        Number, About("Error of the yaw rate; that of a body of revolution cannot be seen", unit="deg/s")
    ]
    coherence_rms_mm: Annotated[
        Number, About("By how far outline rays miss the hull of the other silhouettes, root mean square")
    ]
    path_error_max_mm: Annotated[
        Number, About("Farthest that the centre was from the estimate in any image, since the reference time")
    ]
    path_error_max_deg: Annotated[Number, About("Largest error of the orientation in any image, likewise")]
    start_error_mm: Annotated[
        Number | None,
        About("How far the centre was from the prediction when the hand began to move", empty=_NOT_REACHED),
    ] = None
    start_error_deg: Annotated[
        Number | None, About("Error of the predicted orientation then", empty=_NOT_REACHED)
    ] = None
    transform_object_to_world: Annotated[
        tuple[tuple[Number, ...], ...], About("True pose of the object at the reference time, shape (4, 4)")
    ] = ()


@dataclass(frozen=True, kw_only=True)
class ManipulationSummary(Part):
    """What came of an in-hand motion, kinematically."""

    duration_s: Annotated[Number, About("Duration of the motion")]
    position_error_max_m: Annotated[Number, About("Largest position error of the object")]
    rotation_error_max_deg: Annotated[Number, About("Largest orientation error of the object")]
    contact_drift_max_m: Annotated[
        Number, About("Farthest that a contact got from where its type lets it be")
    ]
    closed_chain_residual_max_m: Annotated[Number, About("Largest residual of the closed chain")]
    joint_velocity_max_rad_s: Annotated[Number, About("Largest joint velocity")]
    redundant: Annotated[bool, About("Whether the grasp is redundant")]
    indeterminate: Annotated[bool, About("Whether the grasp is indeterminate")]
    degrees_of_freedom: Annotated[int, About("Degrees of freedom of hand and object")]
    force_margin_min_n: Annotated[
        Number, About("Smallest margin to a friction cone's side", empty="no forces balance the weight")
    ]
    balanced_share: Annotated[Number, About("Share of the motion in which contact forces balance the weight")]
    pad_indentation_max_m: Annotated[
        Number | None, About("Deepest indentation of a soft pad", empty="other contacts; older result")
    ] = None


@dataclass(frozen=True, kw_only=True)
class GaitFigures(Part):
    """What an independent check found of a motion by finger gaiting."""

    turned_deg: Annotated[Number, About("How far the object has turned about the grasp's normal")]
    turns: Annotated[int, About("Turns between which fingers step, or could")]
    steps: Annotated[int, About("Steps that fingers take")]
    position_error_max_m: Annotated[
        Number, About("Largest distance of the object, as the tips hold it, from its path")
    ]
    rotation_error_max_deg: Annotated[Number, About("Largest angle between its orientation and its path's")]
    tip_error_max_m: Annotated[Number, About("Largest distance of a fingertip from its contact")]
    slip_max_m: Annotated[
        Number, About("Longest way that a fingertip slides over the surface between two steps of it")
    ]
    joint_margin_min_deg: Annotated[Number, About("Smallest distance of a joint to its limit")]
    speed_share_max: Annotated[Number, About("Largest joint velocity as share of the joint's limit")]
    friction_margin_min_n: Annotated[
        Number, About("Smallest friction left at a contact by the recorded forces")
    ]
    verified: Annotated[bool, About("Whether the motion stands before the check")]
    violations: Annotated[tuple[str, ...], About("What the check found")] = ()


@dataclass(frozen=True, kw_only=True)
class SlidingFigures(Part):
    """What an independent check found of contacts that slide on purpose."""

    slid_max_m: Annotated[Number, About("Longest way that a tip slides over the object, of those that shall")]
    stuck_slip_max_m: Annotated[Number, About("Longest way that one of the other tips slides")]
    tip_error_max_m: Annotated[Number, About("Largest distance of a fingertip from its contact")]
    friction_angle_max_deg: Annotated[
        Number, About("Largest angle between a sliding tip's friction and its way, both on the limit surface")
    ]
    surface_error_max: Annotated[
        Number, About("Largest distance of that friction from the limit surface, share of it")
    ]
    reserve_min: Annotated[
        Number, About("Smallest share of its friction that a contact keeps that does not slide")
    ]
    balance_error_max: Annotated[
        Number, About("Largest component of the wrench that the forces miss, N or N m")
    ]
    verified: Annotated[bool, About("Whether the motion stands before the check")]
    violations: Annotated[tuple[str, ...], About("What the check found")] = ()


@dataclass(frozen=True, kw_only=True)
class PlayedResult(Part):
    """What came of an in-hand motion when it was played in physics."""

    success: Annotated[bool, About("Whether the object was held to the end")]
    grip_force_n: Annotated[Number, About("Mean normal force asked of a finger, 0 without a squeeze")]
    friction: Annotated[
        Number | None, About("Coulomb friction between fingertips and object", empty="older result")
    ] = None
    torsional_friction_m: Annotated[
        Number | None, About("Torque about the contact normal per normal force", empty="older result")
    ] = None
    planned_friction: Annotated[
        Number | None, About("Coulomb friction that the grasp was planned with", empty="older result")
    ] = None
    phases: Annotated[
        Mapping[str, PhaseResult], About("Squeeze, lift, hold and the motion", empty=_NOT_REACHED)
    ] = field(default_factory=dict)
    position_error_max_m: Annotated[
        Number | None, About("Largest position error of the object", empty=_NOT_REACHED)
    ] = None
    position_error_end_m: Annotated[Number | None, About("Position error at the end", empty=_NOT_REACHED)] = (
        None
    )
    rotation_error_max_deg: Annotated[
        Number | None, About("Largest orientation error", empty=_NOT_REACHED)
    ] = None
    rotation_error_end_deg: Annotated[
        Number | None, About("Orientation error at the end", empty=_NOT_REACHED)
    ] = None
    moved_max_m: Annotated[
        Number | None, About("How far its centre moved in the palm frame", empty=_NOT_REACHED)
    ] = None
    turned_max_deg: Annotated[
        Number | None, About("How far it turned in the palm frame", empty=_NOT_REACHED)
    ] = None
    turned_about_axis_deg: Annotated[
        Number | None,
        About("How far it turned in the palm about the grasp's normal", empty="not by finger gaiting"),
    ] = None
    slip_max_m: Annotated[
        Number | None, About("Net sliding at the contact that slid farthest", empty=_NOT_REACHED)
    ] = None
    fingers_slipped: Annotated[
        int | None,
        About("Fingers that slid on a contact by more than execution.push_slip_m", empty="older result"),
    ] = None
    steps: Annotated[int | None, About("Steps that fingers took in physics", empty="older result")] = None
    steps_missed: Annotated[
        int | None, About("Steps that ended without a touch of the object", empty="older result")
    ] = None
    histories: Annotated[
        Mapping[str, tuple[Number, ...]], About("Errors and motion by time", column=False)
    ] = field(default_factory=dict)
