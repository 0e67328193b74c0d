"""How what carries the hand is described in the configuration."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from graspbench.hand.parameters import Vector3


@dataclass(frozen=True)
class ArmParameters:
    """What carries the hand: a wrist that floats, or an arm that is read from a URDF (group ``arm``)."""

    name: Annotated[str, Field(description="Name of the arm")] = "floating"
    urdf: Annotated[
        str | None,
        Field(
            description="URDF file of the arm: a path, or package://PACKAGE/PATH of an installed package; "
            "null: the hand floats"
        ),
    ] = None
    package_dirs: Annotated[
        tuple[str, ...],
        Field(description="Folders to look for package:// files in, besides the installed ones"),
    ] = ()
    base: Annotated[
        str | None, Field(description="Link that stands on the table or on a pedestal; null: the root")
    ] = None
    tip: Annotated[
        str | None,
        Field(
            description="Link that carries the hand; null: the last one that all chains of joints have in "
            "common (what hangs on it, such as a gripper, is left out)"
        ),
    ] = None
    flange_xyz_m: Annotated[
        Vector3 | None,
        Field(
            description="Middle of the flange in that link; null: where its shapes end along the last axis, m"
        ),
    ] = None
    flange_rpy_deg: Annotated[
        Vector3 | None,
        Field(
            description="Roll, pitch, yaw of the flange in that link (fixed axes), its z axis outwards; "
            "null: along the last joint's axis, deg"
        ),
    ] = None
    palm_xyz_m: Annotated[
        Vector3 | None,
        Field(
            description="Origin of the palm frame in the flange's, m; null, like palm_rpy_deg: the hand is "
            "bolted on by a straight, a 45 deg or a right-angled bracket, as suits the grasp"
        ),
    ] = None
    palm_rpy_deg: Annotated[
        Vector3 | None,
        Field(description="Roll, pitch, yaw of the palm in the flange (fixed axes), deg; null: 0 0 0"),
    ] = None
    speed_limits_deg: Annotated[
        tuple[float, ...] | None,
        Field(description="Speed limits of its joints in order, instead of the URDF's, deg/s (slides: mm/s)"),
    ] = None
    speed_limit_deg: Annotated[
        float, Field(gt=0, description="Speed limit of joints that state none, deg/s (slides: mm/s)")
    ] = 90.0
    effort_limit_nm: Annotated[
        float, Field(gt=0, description="Torque limit of joints that state none, N m (slides: N)")
    ] = 150.0
    density_kg_m3: Annotated[
        float, Field(gt=0, description="Density of links that state no mass, kg/m^3")
    ] = 2000.0


FLOATING = ArmParameters()
