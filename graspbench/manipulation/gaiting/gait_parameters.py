"""Options of finger gaiting: the section ``motion.gait``."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

GAITING = ("rolling", "hard", "soft")
"""Kinds of contact on which fingers can gait."""


@dataclass(frozen=True)
class GaitParameters:
    """How far and how an object is turned by fingers that step over it one by one."""

    angle_deg: Annotated[
        float,
        Field(
            ge=-360,
            le=360,
            description="Turn about the grasp's normal, counter-clockwise seen from the palm, deg; 0: none",
        ),
    ] = 0.0
    max_turn_deg: Annotated[
        float, Field(ge=1, le=90, description="Largest turn between two rounds of steps, deg")
    ] = 40.0
    turn_speed_deg_s: Annotated[
        float, Field(gt=0, le=360, description="Mean angular speed of the object while it turns, deg/s")
    ] = 15.0
    lift_m: Annotated[
        float, Field(gt=0, le=0.1, description="How far a stepping fingertip keeps off the surface, m")
    ] = 0.01
    step_time_s: Annotated[
        float, Field(gt=0, description="Time of one step; longer where joints are slow, s")
    ] = 1.0
    friction_reserve: Annotated[
        float,
        Field(
            ge=0, lt=1, description="Share of its friction that every contact keeps while one finger is off"
        ),
    ] = 0.05
    joint_margin: Annotated[
        float,
        Field(ge=0, lt=0.5, description="Share of its range that a joint keeps from its limits, as planned"),
    ] = 0.03
    starts: Annotated[
        int,
        Field(
            ge=0,
            le=64,
            description="Other grasps to try to start from if the planned one has no gait, drawn at "
            "random, the best by Q3 first",
        ),
    ] = 8
