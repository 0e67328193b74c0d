"""Parameters of the local planner."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

PhiCeiDeg = Annotated[
    float,
    Field(gt=0, le=90, description="Largest coplanarity error; two contacts: largest antipodal error, deg"),
]
"""Threshold of the coplanarity error of an outer triangle (thesis A.2)."""

PhiEegiDeg = Annotated[float, Field(gt=0, le=20, description="Largest equilateral error, deg")]
"""Threshold of the equilateral error (thesis A.2); up to 20 no two normals can be less than 90 deg apart,
and the bounds of the global search rest on that."""

PHI_CEI_DEG, PHI_EEGI_DEG = 15.0, 10.0
"""The thesis' thresholds."""


@dataclass(frozen=True)
class BarrierParameters:
    """Where the kinematic barrier begins; it is infinite at the hand's own margins."""

    joint_margin: Annotated[
        float,
        Field(gt=0, lt=0.5, description="Distance to a joint limit where f_j begins, share of the range"),
    ] = 0.08
    singular_value_m: Annotated[
        float, Field(gt=0, description="Smallest singular value of the tip Jacobian where f_s begins, m/rad")
    ] = 0.012
    clearance_m: Annotated[
        float, Field(gt=0, description="Distance to other fingers, palm and ground where f_c begins")
    ] = 0.006
    strength_n: Annotated[
        float, Field(ge=0, description="Force of each term where it is half-way to the margin")
    ] = 0.02


@dataclass(frozen=True)
class PathParameters:
    """How the fingertips get from their via points to the contacts (thesis 3.5)."""

    filter: Annotated[
        Literal["path", "causal"],
        Field(
            description="Spatial filter of the via points: over the whole way that led to the grasp, or a "
            "low-pass that knows only what came before"
        ),
    ] = "path"
    max_turning_deg: Annotated[
        float, Field(gt=0, description="path: how far a tip may turn in all on its way to the contact")
    ] = 90.0
    filter_gain: Annotated[
        float, Field(gt=0, le=1, description="causal: gain of the low-pass; 1: no filter")
    ] = 0.5
    tip_speed_m_s: Annotated[float, Field(gt=0, description="Mean speed of the fastest tip on its way")] = (
        0.15
    )
    closing_time_s: Annotated[
        float, Field(gt=0, description="Time of the last approach along the normal")
    ] = 0.5
    time_step_s: Annotated[float, Field(gt=0, description="Time between two samples of a path")] = 0.005
    retreat_m: Annotated[
        float,
        Field(ge=0, description="How far back from its grasp pose the palm starts, against its approach"),
    ] = 0.03
    tracking_gain: Annotated[
        float, Field(gt=0, description="Gain of the tip error in the kinematic loop, 1/s")
    ] = 60.0
    acceleration_limit_rad_s2: Annotated[
        float, Field(gt=0, description="Largest acceleration of a joint, rad/s^2")
    ] = 40.0
    velocity_share: Annotated[
        float, Field(gt=0, le=1, description="Share of the joint velocity limits that may be used")
    ] = 0.9


@dataclass(frozen=True)
class RefineParameters:
    """How long a grasp is refined."""

    jumps: Annotated[
        int,
        Field(ge=0, le=1000, description="Jumps in a row that lead to nothing better, after which to stop"),
    ] = 6
    draws: Annotated[int, Field(ge=1, description="Random grasps, the best of which a jump goes to")] = 1000
    jump_down: Annotated[
        float, Field(gt=0, le=1, description="Share of the measure that a jump has to keep at least")
    ] = 0.5
    seed: Annotated[int, Field(ge=0, description="Seed of the jumps")] = 0


@dataclass(frozen=True)
class RobustParameters:
    """Choice of the grasp that forgives errors most, among the index's best."""

    reserve: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description="select=index: share of its friction that each contact shall keep when the fingers "
            "squeeze. Of grasps that the index thinks equal the best that keeps it is taken, else the one "
            "that keeps most; 0: the index alone decides",
        ),
    ] = 0.45
    tolerance: Annotated[
        float,
        Field(ge=0, le=1, description="Share of the best grasp's index up to which others count as equal"),
    ] = 0.1
    equals: Annotated[
        int, Field(ge=1, le=1000, description="Equal grasps, the hand included, that are looked at most")
    ] = 12
    among: Annotated[
        int,
        Field(
            ge=1,
            description="select=index: of so many grasps that the hand holds, the index's best, the most "
            "robust is taken; 1: the index alone decides",
        ),
    ] = 1
    samples: Annotated[int, Field(ge=3, le=10_000, description="Errors drawn for a grasp")] = 48
    position_sigma_m: Annotated[
        float, Field(ge=0, description="Standard deviation of a contact along each tangent, m")
    ] = 0.003
    normal_sigma_deg: Annotated[
        float, Field(ge=0, lt=45, description="Standard deviation of a normal's tilt about each tangent, deg")
    ] = 10.0
    friction_sigma: Annotated[
        float, Field(ge=0, lt=0.8, description="Standard deviation of the friction coefficient, share of it")
    ] = 0.15
    seed: Annotated[int, Field(ge=0, description="Seed of the errors")] = 0


@dataclass(frozen=True)
class AnyPlannerParameters:
    """What any planner may be told: how long to plan, and how the hand gets to the grasp."""

    time_limit_s: Annotated[
        float,
        Field(
            gt=0,
            description="Time after which a planner that goes on yields nothing more, s; parallel and "
            "restarted end by themselves",
        ),
    ] = 60.0
    floating_distance_m: Annotated[
        float,
        Field(ge=0, description="Distance delta_f that the tips keep from the surface while they approach"),
    ] = 0.02
    paths: Annotated[PathParameters, Field(description="Fingertip paths")] = field(
        default_factory=PathParameters
    )
    refine: Annotated[RefineParameters, Field(description="Refinement of a grasp by a measure")] = field(
        default_factory=RefineParameters
    )


@dataclass(frozen=True)
class PlannerParameters(AnyPlannerParameters):
    """How the local planner searches, while the surface forms (parallel) or afterwards (restarted)."""

    mode: Annotated[
        Literal["lockstep", "concurrent"],
        Field(
            description="concurrent: surface and planner move at the same time, each in a thread; "
            "lockstep: one after the other; the grasp is the same"
        ),
    ] = "concurrent"
    rotations: Annotated[
        int, Field(ge=1, le=360, description="Rotations of the first equilateral grasp to try in each plane")
    ] = 6
    planes: Annotated[
        int,
        Field(ge=1, le=11, description="Planes of the first grasp to try when the best grasp is selected"),
    ] = 11
    followers: Annotated[
        int,
        Field(
            ge=1,
            le=5000,
            description="Grasps that follow the surface until it rests; 1: the thesis' single one",
        ),
    ] = 48
    restart: Annotated[
        bool, Field(description="Plan by multi-start on the finished surface too (restarted.*)")
    ] = False
    candidates: Annotated[
        int, Field(ge=1, le=1000, description="Grasps, the hand included, to choose the best from")
    ] = 4
    select: Annotated[
        Literal["first", "index", "quality"],
        Field(
            description="Which grasp to keep: what a single follower becomes, or else the first that "
            "works; the best by the index; or the best by Q1 Q2 Q3"
        ),
    ] = "index"
    max_moves: Annotated[
        int, Field(ge=1, le=100_000, description="Moves on one surface after which the planner gives up")
    ] = 500
    wrist_moves: Annotated[
        int, Field(ge=1, description="Moves after which the wrist follows the fingers")
    ] = 4
    barrier: Annotated[BarrierParameters, Field(description="The kinematic barrier")] = field(
        default_factory=BarrierParameters
    )
    robust: Annotated[
        RobustParameters, Field(description="Choice of the most robust among the index's best grasps")
    ] = field(default_factory=RobustParameters)
