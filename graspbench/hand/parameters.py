"""How a hand is described in the configuration."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

Vector3 = tuple[float, float, float]
TipShape = Literal["sphere", "link"]


@dataclass(frozen=True)
class Margins:
    """What a posture has to keep to count as feasible."""

    ground_m: Annotated[float, Field(ge=0, description="Least distance from the hand to the ground, m")] = (
        0.002
    )
    hand_m: Annotated[
        float, Field(ge=0, description="Least distance between fingers, and from them to the palm, m")
    ] = 0.001
    object_m: Annotated[
        float, Field(ge=0, description="Least distance from palm and links to the object, m")
    ] = 0.001
    joint: Annotated[
        float, Field(ge=0, lt=0.5, description="Least distance of a joint to its limits, share of its range")
    ] = 0.01
    singular_value_m: Annotated[
        float, Field(ge=0, description="Least singular value of a finger's tip Jacobian, m/rad")
    ] = 0.004


@dataclass(frozen=True)
class PalmDescription:
    """The palm frame: its z axis is the approach direction, from the palm towards the object."""

    link: Annotated[str, Field(description="Link the palm frame is fixed to")] = "palm"
    xyz_m: Annotated[Vector3, Field(description="Origin of the palm frame in that link, m")] = (0.0, 0.0, 0.0)
    rpy_deg: Annotated[
        Vector3, Field(description="Roll, pitch, yaw of the palm frame in that link (fixed axes), deg")
    ] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FingerDescription:
    """One finger: a chain of joints from the palm to a tip."""

    name: Annotated[str, Field(description="Name of the finger")]
    tip: Annotated[str, Field(description="Link whose origin is the centre of the tip")]
    tip_xyz_m: Annotated[
        Vector3, Field(description="Centre of the tip in that link, where it is not the origin, m")
    ] = (0.0, 0.0, 0.0)
    joints: Annotated[
        tuple[str, ...] | None, Field(description="Its joints from palm to tip; null: all on the way")
    ] = None
    posture_deg: Annotated[
        tuple[float, ...] | None, Field(description="Preferred joints of a grasp, deg; null: mid-range")
    ] = None
    rest_deg: Annotated[
        tuple[float, ...] | None,
        Field(description="Joints while the finger is not used, deg; null: preferred"),
    ] = None


@dataclass(frozen=True)
class CollisionShape:
    """A collision shape that replaces those of a URDF's link."""

    kind: Annotated[Literal["box", "cylinder", "sphere"], Field(description="Kind of the shape")]
    size_m: Annotated[
        tuple[float, ...],
        Field(description="Edges of the box; radius and length of the cylinder; radius of the sphere; m"),
    ]
    xyz_m: Annotated[Vector3, Field(description="Its centre in the link's frame, m")] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FileFrame:
    """How the grasp files of another benchmark state a hand."""

    link: Annotated[
        str | None, Field(description="Link that the files' pose of the hand is fixed to; null: the root")
    ] = None
    xyz_m: Annotated[Vector3, Field(description="Origin of the files' hand frame in that link, m")] = (
        0.0,
        0.0,
        0.0,
    )
    rpy_deg: Annotated[
        Vector3, Field(description="Roll, pitch, yaw of the files' hand frame in that link (fixed axes), deg")
    ] = (0.0, 0.0, 0.0)
    joints: Annotated[
        dict[str, str],
        Field(description="The hand's joint for each joint of the files, in their order; empty: the hand's"),
    ] = field(default_factory=dict)


@dataclass(frozen=True)
class HandParameters:
    """A robot hand with a floating wrist (group ``hand``)."""

    name: Annotated[str, Field(description="Name of the hand")] = "radial"
    kind: Annotated[
        Literal["radial", "urdf"], Field(description="radial: generated; urdf: read from a file")
    ] = "radial"
    fingers: Annotated[int, Field(ge=2, le=5, description="Number of fingers to use")] = 3
    tip_radius_m: Annotated[
        float,
        Field(gt=0, description="Radius of the spherical fingertips; of tip_shape link half their width, m"),
    ] = 0.008
    tip_shape: Annotated[
        TipShape,
        Field(
            description="What a finger touches with: a sphere at its tip, added where the description has "
            "none, or the collision shapes of its last link as they are (urdf)"
        ),
    ] = "sphere"

    palm_radius_m: Annotated[float, Field(gt=0, description="Radius of the round palm (radial), m")] = 0.05
    palm_thickness_m: Annotated[float, Field(gt=0, description="Thickness of the palm (radial), m")] = 0.02
    link_lengths_m: Annotated[
        Vector3, Field(description="Proximal, middle and distal link of a finger (radial), m")
    ] = (0.070, 0.055, 0.045)
    link_radius_m: Annotated[float, Field(gt=0, description="Radius of the finger links (radial), m")] = 0.006
    lower_deg: Annotated[
        tuple[float, float, float, float],
        Field(description="Lower limits: abduction, then three flexions, positive inwards (radial), deg"),
    ] = (-40.0, -75.0, 0.0, 0.0)
    upper_deg: Annotated[
        tuple[float, float, float, float], Field(description="Upper limits in the same order (radial), deg")
    ] = (40.0, 45.0, 110.0, 90.0)
    posture_deg: Annotated[
        tuple[float, float, float, float],
        Field(description="Preferred joints of a grasp in the same order (radial), deg"),
    ] = (0.0, -35.0, 50.0, 35.0)
    velocity_limit_deg: Annotated[
        float,
        Field(gt=0, description="Velocity limit of all joints (radial) or those without one (urdf), deg/s"),
    ] = 180.0
    effort_limit_nm: Annotated[
        float,
        Field(gt=0, description="Torque limit of all joints (radial) or those without one (urdf), N m"),
    ] = 2.0
    density_kg_m3: Annotated[
        float,
        Field(
            gt=0, description="Density of palm and links (radial) or of those without a mass (urdf), kg/m^3"
        ),
    ] = 1500.0

    urdf: Annotated[
        str | None,
        Field(description="URDF file (urdf): a path, or package://PACKAGE/PATH of an installed package"),
    ] = None
    package_dirs: Annotated[
        tuple[str, ...],
        Field(description="Folders to look for package:// files in, besides the installed ones"),
    ] = ()
    palm: Annotated[PalmDescription, Field(description="Palm frame (urdf)")] = field(
        default_factory=PalmDescription
    )
    chains: Annotated[
        tuple[FingerDescription, ...], Field(description="The fingers in order around the palm (urdf)")
    ] = ()
    subsets: Annotated[
        dict[int, tuple[str, ...]],
        Field(description="Which fingers are used when fewer are asked for; default: the first ones (urdf)"),
    ] = field(default_factory=dict)
    locked_deg: Annotated[
        dict[str, float],
        Field(description="Joints that are held, and where; a wrist's are at 0 without this (urdf), deg"),
    ] = field(default_factory=dict)
    collision: Annotated[
        dict[str, tuple[CollisionShape, ...]],
        Field(description="Collision shapes by link, instead of the URDF's (urdf)"),
    ] = field(default_factory=dict)
    margins: Annotated[Margins, Field(description="What a feasible posture has to keep")] = field(
        default_factory=Margins
    )
    formats: Annotated[
        dict[str, FileFrame],
        Field(
            description="How files of dexgraspbench, dexgraspnet or isaac state this hand (evaluate, export)"
        ),
    ] = field(default_factory=dict)
