"""Options of sliding with friction: the section ``contact.sliding``."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field


@dataclass(frozen=True)
class SlidingParameters:
    """Which contacts slide over the object, and how far; the others hold it."""

    fingers: Annotated[
        tuple[int, ...],
        Field(description="Fingers whose contacts slide, counted from 0; empty: none"),
    ] = ()
    way_m: Annotated[
        tuple[float, float, float],
        Field(
            description="Way of their contacts over the object, palm axes, of which the part along the "
            "surface counts; zero: they go where hand and contacts move least, m"
        ),
    ] = (0.0, 0.0, 0.0)
    friction_reserve: Annotated[
        float,
        Field(ge=0, lt=1, description="Share of its friction that every contact keeps that does not slide"),
    ] = 0.05
    wrench: Annotated[
        tuple[float, float, float, float, float, float],
        Field(
            description="Force and torque that the fingers apply to the object beside its weight and "
            "inertia, palm axes, N and N m"
        ),
    ] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
