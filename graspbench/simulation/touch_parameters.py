"""Exploring touches and grasps before a grasp: how many, and what is believed beforehand."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field


@dataclass(frozen=True)
class TouchParameters:
    """Touches by single fingers that correct what vision said, and grasps that only feel."""

    max_touches: Annotated[
        int, Field(ge=0, le=50, description="Most exploring touches before the grasp; 0: none")
    ] = 0
    max_grasps: Annotated[
        int,
        Field(
            ge=0,
            le=50,
            description="Most exploring grasps, of which the one that feels best is executed; 0: none",
        ),
    ] = 0
    measure: Annotated[
        Literal["q1", "q2", "q3"], Field(description="What exploring grasps are to make as large as they can")
    ] = "q3"
    enough_share: Annotated[
        float,
        Field(
            gt=0,
            le=1,
            description="Share of the global search's certified bound at which exploring grasps end",
        ),
    ] = 0.95
    measure_std: Annotated[
        float,
        Field(
            gt=0,
            le=2,
            description="Standard deviation of a felt measure from the foreseen, over the largest foreseen",
        ),
    ] = 0.25
    enough_mm: Annotated[
        float,
        Field(ge=0, le=50, description="Expected error of the contacts' places that is good enough, mm"),
    ] = 0.8
    position_std_mm: Annotated[
        float, Field(gt=0, le=100, description="Standard deviation of the object's place per axis, mm")
    ] = 4.0
    yaw_std_deg: Annotated[float, Field(gt=0, le=90, description="Standard deviation of its yaw, deg")] = 8.0
    noise_mm: Annotated[
        float, Field(gt=0, le=20, description="Standard deviation of a felt distance to the surface, mm")
    ] = 0.7
    shape_std_mm: Annotated[
        float, Field(gt=0, le=50, description="Standard deviation of the surface's own error, mm")
    ] = 2.0
    shape_length_mm: Annotated[
        float, Field(gt=0, le=500, description="Length over which that error varies, mm")
    ] = 12.0
    speed_m_s: Annotated[float, Field(gt=0, le=0.5, description="Speed of a feeling fingertip, m/s")] = 0.04
    reach_mm: Annotated[float, Field(gt=0, le=200, description="Farthest way of a feeling fingertip, mm")] = (
        40.0
    )
