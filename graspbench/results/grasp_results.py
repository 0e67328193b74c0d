"""What a result says of the grasps that a trial planned."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

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


@dataclass(frozen=True)
class PlannedResult(Part):
    """Which planner planned, and when grasps came."""

    planner: Annotated[str, About("Name of the planner")]
    grasps: Annotated[int, About("Grasps that it found, the hand and force closure checked")]
    first_s: Annotated[Number, About("When the first one came, since the reconstruction began")]
    best_s: Annotated[Number, About("When the one that was chosen came, since the reconstruction began")]
    diversity_mm: Annotated[
        Number | None,
        About("Mean distance of the contacts over all pairs of them", empty="fewer than two were found"),
    ]


@dataclass(frozen=True)
class FormedResult(Part):
    """How good the planner's best grasp was when the surface was formed so far, on the finished surface."""

    q1: Annotated[Number, About("Smallest singular value of the grasp matrix")]
    q2: Annotated[Number, About("Volume of the ellipsoid of wrenches")]
    q3: Annotated[Number, About("Largest ball in the grasp wrench space")]
    followers: Annotated[int, About("Grasps that followed the surface then")]


_OLDER = "the result is of an older version"
_NOT_LOCAL = "a planner found the grasp that climbs no index"
_OLDER_OR_NOT_LOCAL = f"{_OLDER}, or {_NOT_LOCAL}"


@dataclass(frozen=True, kw_only=True)
class LocalResult(GraspResult):
    """The grasp that the planner chose, and how the local planner found it where it did."""

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
    score: Annotated[
        Number,
        About("What the planner thinks of the grasp, in its own unit: the index, where it climbs one"),
    ]
    found_by: Annotated[
        Literal["follower", "restart"] | None,
        About(
            "follower: the grasp followed the surface while it formed; restart: no follower became a grasp, "
            "and it was found from first grasps on the finished surface",
            empty=_OLDER_OR_NOT_LOCAL,
        ),
    ] = None
    followed_share: Annotated[
        Number | None,
        About(
            "Share of the contacts that were there before the surface rested",
            empty=_OLDER_OR_NOT_LOCAL,
        ),
    ] = None
    polish_mm: Annotated[
        Number | None,
        About("Mean way of the contacts once the surface rested", empty=_OLDER_OR_NOT_LOCAL),
    ] = None
    formed: Annotated[
        Mapping[str, FormedResult],
        About("The best grasp when the surface was formed to 50, 80 and 100 %, before the hand has its say"),
    ] = field(default_factory=dict)
    rotations_tried: Annotated[
        int | None, About("First grasps that were followed to a local optimum", empty=_NOT_LOCAL)
    ] = None
    rejected: Annotated[
        Mapping[str, int], About("Why what was tried was no grasp, and how often", column=False)
    ]
    iterations: Annotated[int | None, About("Surfaces that were planned on", empty=_NOT_LOCAL)] = None
    surfaces_made: Annotated[int | None, About("Surfaces that were made", empty=_NOT_LOCAL)] = None
    moves: Annotated[int | None, About("Moves of all grasps that were followed", empty=_NOT_LOCAL)] = None
    evaluations: Annotated[int | None, About("Proposals asked from the index", empty=_NOT_LOCAL)] = None
    contour_queries: Annotated[
        int | None, About("Inverse kinematics of fingers at contour points", empty=_NOT_LOCAL)
    ] = None
    cycles: Annotated[
        int | None, About("Times the index wanted back to a configuration it had left", empty=_NOT_LOCAL)
    ] = None
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
class RestartedResult(GraspResult):
    """The grasp of a multi-start on the finished surface; no parallel planner could have it in time."""

    q1: Annotated[Number, About("Smallest singular value of the grasp matrix")]
    q2: Annotated[Number, About("Volume of the ellipsoid of wrenches")]
    q3: Annotated[Number, About("Largest ball in the grasp wrench space")]
    score: Annotated[Number, About("What the index thinks of the grasp; the index's own unit")]
    rotations_tried: Annotated[int, About("First grasps that were climbed")]
    moves: Annotated[int, About("Moves of all grasps that the hand tried")]
    time_s: Annotated[Number, About("Wall time of the multi-start")]


@dataclass(frozen=True, kw_only=True)
class StrengthenedResult(GraspResult):
    """The grasp that was executed in place of one that would hardly have held, or that could not be."""

    q1: Annotated[Number, About("Smallest singular value of the grasp matrix")]
    q2: Annotated[Number, About("Volume of the ellipsoid of wrenches")]
    q3: Annotated[Number, About("Largest ball in the grasp wrench space")]
    for_weight: Annotated[
        bool, About("Whether it was planned again, because the first grasp was too weak for the object")
    ]
    climbed: Annotated[bool, About("Whether it climbed Q3 from the planned grasp")]
    for_way: Annotated[
        bool, About("Whether it was taken because no way leads to the planned grasp, or no arm reaches it")
    ] = False
    for_gait: Annotated[bool, About("Whether it was taken because the planned grasp has no gait")] = False
    verified: Annotated[
        bool | None,
        About("Whether the posture stands before an independent check", empty="there is no posture"),
    ] = None
    violations: Annotated[tuple[str, ...], About("What the check found")] = ()


@dataclass(frozen=True, kw_only=True)
class ExploredResult(GraspResult):
    """The grasp that felt best of a few that the whole hand felt; it was executed."""

    q1: Annotated[Number, About("Smallest singular value of the grasp matrix, on the surface as seen")]
    q2: Annotated[Number, About("Volume of the ellipsoid of wrenches, on the surface as seen")]
    q3: Annotated[Number, About("Largest ball in the grasp wrench space, on the surface as seen")]
    measure: Annotated[str, About("The measure that was optimised")]
    grasps: Annotated[int, About("Grasps that were felt")]
    candidates: Annotated[int, About("Grasps that they were chosen from")]
    value: Annotated[Number, About("The measure at the contacts that the executed grasp felt")]
    first: Annotated[Number, About("The same of the grasp that would have been executed otherwise")]
    felt: Annotated[
        tuple[Number, ...], About("The measure of each grasp felt, in their order; 0 where a finger missed")
    ]
    foreseen: Annotated[tuple[Number, ...], About("The same on the surface as it was seen")]
    best: Annotated[int, About("Which of them was executed, from 0")]
    bound: Annotated[
        Number | None, About("Certified upper bound on the seen surface", empty="it was not searched for")
    ]
    ended: Annotated[str, About("Why it ended: enough, number, no gain or no candidate")]
    moved_mm: Annotated[Number, About("By how much the object was moved by it all")]
    time_s: Annotated[Number, About("Simulated time that it took")]
    verified: Annotated[
        bool | None,
        About("Whether the posture stands before an independent check", empty="there is no posture"),
    ] = None
    violations: Annotated[tuple[str, ...], About("What the check found")] = ()


@dataclass(frozen=True, kw_only=True)
class GlobalGraspResult(GraspResult):
    """The best grasp of the finished surface by one measure, and its certificate."""

    value: Annotated[Number, About("The measure of the best grasp", empty="no grasp was found")]
    upper_bound: Annotated[Number, About("No grasp that meets the constraints has a larger measure: proved")]
    gap: Annotated[Number, About("(upper_bound - value) / upper_bound")]
    optimal: Annotated[bool, About("Whether it is proved that no grasp is better")]
    upper_bound_up_to_solver: Annotated[
        Number, About("No grasp that the posture solver finds a hand for has a larger measure")
    ]
    optimal_up_to_solver: Annotated[
        bool, About("Whether every grasp that would be better was refused by the posture solver")
    ]
    doubtful: Annotated[
        int | None,
        About(
            "Grasps that would be better, refused by the solver but not proved to be out of reach",
            empty="the result is of a version that did not count them",
        ),
    ]
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
