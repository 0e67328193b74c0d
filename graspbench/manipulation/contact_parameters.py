"""How fingertips meet an object that they move: configuration group ``contact``."""

from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from graspbench.manipulation.contact_kinematics import ContactType
from graspbench.manipulation.forces import ForceParameters
from graspbench.manipulation.sliding.sliding_parameters import SlidingParameters

_UNKNOWN_MASS_KG = 0.1


@dataclass(frozen=True)
class ContactParameters:
    """How a hand's fingertips meet the object while they move it."""

    kind: Annotated[
        ContactType,
        Field(description="rolling (spherical tips without slip), hard, soft, soft_pad or frictionless"),
    ] = "rolling"
    patch_radius_m: Annotated[float, Field(gt=0, description="Size of the local charts on a mesh")] = 0.015
    mass_kg: Annotated[
        float | None,
        Field(gt=0, description="Mass of the object, for the contact forces; the object's own if null"),
    ] = None
    force_rate_hz: Annotated[float, Field(gt=0, description="How often contact forces are computed")] = 50.0
    forces: Annotated[ForceParameters, Field(description="Contact force distribution")] = field(
        default_factory=ForceParameters
    )
    sliding: Annotated[SlidingParameters, Field(description="Contacts that slide with friction")] = field(
        default_factory=SlidingParameters
    )

    @property
    def carried_kg(self) -> float:
        """The mass that the fingers carry, an assumed one where it is not known."""
        return _UNKNOWN_MASS_KG if self.mass_kg is None else self.mass_kg
