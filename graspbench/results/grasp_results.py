"""What a result says of the grasps that a trial planned."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from graspbench.results.about import About, Number, Part

Vector = tuple[Number, ...]


@dataclass(frozen=True)
class ContactResult(Part):
    """One contact of a grasp."""

    vertex: Annotated[int, About("Node of the surface")]
    point: Annotated[Vector, About("Where, world frame", unit="m")]
    normal: Annotated[Vector, About("Outward unit normal, world frame")]


@dataclass(frozen=True)
class PostureResult(Part):
    """The hand at a grasp."""

    transform_palm_to_world: Annotated[tuple[Vector, ...], About("Pose of the palm, shape (4, 4)")]
    joints: Annotated[Vector, About("Joint positions in the hand's order", unit="rad")]
    fingers: Annotated[tuple[int, ...], About("Finger at each contact")]
    tip_error_m: Annotated[Number, About("Largest distance between a fingertip and its target")]
    joint_margin: Annotated[Number, About("Smallest distance of a joint to a limit, share of its range")]
    smallest_singular_value: Annotated[
        Number, About("Smallest singular value of the fingers' tip Jacobians", unit="m/rad")
    ]
    clearance_m: Annotated[Number, About("Smallest distance between fingers, palm and ground")]


@dataclass(frozen=True, kw_only=True)
class GraspResult(Part):
    """A grasp: contacts, and the hand that holds them."""

    contacts: Annotated[tuple[ContactResult, ...], About("The contacts")] = ()
    centroid: Annotated[Vector, About("Centroid of the surface", unit="m")] = ()
    posture: Annotated[
        PostureResult | None, About("The hand at the grasp", empty="the grasp was planned without a hand")
    ] = None
    measures: Annotated[
        Mapping[str, Number], About("Further measures asked for by quality.measures, each in its own unit")
    ] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class LocalResult(GraspResult):
    """The local planner's grasp, and how it was found."""

    q1: Annotated[Number, About("Smallest singular value of the grasp matrix")]
    q2: Annotated[Number, About("Volume of the ellipsoid of wrenches")]
    q3: Annotated[Number, About("Largest ball in the grasp wrench space")]
    mirtich_canny: Annotated[
        Number | None,
        About(
            "Area of the outer triangle, within the criterion's thresholds",
            unit="m^2",
            empty="not among search.measures, or the grasp is not within the thresholds",
        ),
    ] = None
    score: Annotated[Number, About("What the index thinks of the grasp; the index's own unit")]
    rotations_tried: Annotated[int, About("First grasps that were followed to a local optimum")]
    rejected: Annotated[
        Mapping[str, int], About("Why local optima were no grasps, and how often", column=False)
    ]
    iterations: Annotated[int, About("Surfaces that were planned on")]
    surfaces_made: Annotated[int, About("Surfaces that were made")]
    moves: Annotated[int, About("Moves of all grasps that were followed")]
    evaluations: Annotated[int, About("Proposals asked from the index")]
    contour_queries: Annotated[int, About("Inverse kinematics of fingers at contour points")]
    cycles: Annotated[int, About("Times the index wanted back to a configuration it had left")]
    force_closure: Annotated[bool, About("Whether the grasp is force closure")]
    reconstruction_time_s: Annotated[Number, About("Time of the reconstruction alone")]
    planning_time_s: Annotated[Number, About("Time of the planner alone")]
    time_s: Annotated[Number, About("Time of both together, as waited for")]
    verified: Annotated[
        bool | None,
        About(
            "Whether the posture stands before a check of its own (Pinocchio and Coal)",
            empty="the grasp has no posture",
        ),
    ] = None
    violations: Annotated[tuple[str, ...], About("What that check found")] = ()


@dataclass(frozen=True, kw_only=True)
class GlobalGraspResult(GraspResult):
    """The best grasp of the finished surface by one measure, and its certificate."""

    value: Annotated[Number, About("The measure of the best grasp", empty="no grasp was found")]
    upper_bound: Annotated[Number, About("No grasp that meets the constraints has a larger measure")]
    gap: Annotated[Number, About("(upper_bound - value) / upper_bound")]
    optimal: Annotated[bool, About("Whether it is proved that no grasp is better")]
    evaluated: Annotated[int, About("Grasps whose measure was computed")]
    pruned: Annotated[Number, About("Share of all combinations excluded without being evaluated")]
    placements: Annotated[int, About("Grasps that the hand was asked to hold")]
    time_s: Annotated[Number, About("Wall time of the search")]


@dataclass(frozen=True, kw_only=True)
class RefinedGraspResult(GraspResult):
    """The grasp to which one measure was climbed from the local one."""

    start_value: Annotated[Number, About("The measure where the climb began")]
    value: Annotated[Number, About("The measure at the summit")]
    steps: Annotated[int, About("Moves from the first grasp to this one")]
    evaluated: Annotated[int, About("Grasps whose measure was bounded or computed")]
    placements: Annotated[int, About("Grasps that the hand was asked to hold")]
    time_s: Annotated[Number, About("Wall time of the climb")]
