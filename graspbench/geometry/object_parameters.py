"""Which object a configuration means, and what is changed about it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field

from graspbench.geometry.frames import Axis

Colour = tuple[
    Annotated[float, Field(ge=0, le=1)],
    Annotated[float, Field(ge=0, le=1)],
    Annotated[float, Field(ge=0, le=1)],
    Annotated[float, Field(ge=0, le=1)],
]

YCB = "ycb"
FILE_CHOICES = ("mesh", "folder", YCB)
"""Names of configuration choices that stand for the user's files, not for an entry of the catalogue."""


@dataclass(frozen=True)
class ObjectParameters:
    """Which object, and what is changed about it.

    A mesh file comes before a folder, and a folder before the catalogue's entry. Whatever is None is
    taken from that entry.
    """

    name: Annotated[
        str, Field(min_length=1, description="Name in the catalogue; of a mesh file: what to call it")
    ] = "teddy"
    entry: Annotated[
        str | None, Field(description="Path of a catalogue entry of your own (YAML), instead of a name")
    ] = None
    mesh: Annotated[str | None, Field(description="Path of a mesh file (.obj .stl .ply .glb .off)")] = None
    folder: Annotated[
        str | None, Field(description="Folder of mesh files, or of YCB objects; id says which one")
    ] = None
    id: Annotated[
        int | str | None,
        Field(description="Which object of a family or folder: number (from 0, sorted by name) or file stem"),
    ] = None
    shape: Annotated[
        dict[str, Any],
        Field(description="Parameters of the catalogue entry's shape to change, such as height_m"),
    ] = field(default_factory=dict)
    scale: Annotated[
        Annotated[float, Field(gt=0)] | Literal["guess"],
        Field(description="Factor on all lengths; metres per unit of a mesh file, or guess, with a warning"),
    ] = 1.0
    up: Annotated[Axis, Field(description="The axis that points up")] = "z"
    yaw_deg: Annotated[float, Field(description="Turn about the vertical before it is put down")] = 0.0
    repair: Annotated[
        bool,
        Field(description="Close holes, join or drop bodies of a mesh file instead of refusing it"),
    ] = False
    density_kg_m3: Annotated[float | None, Field(gt=0, description="Density, kg/m^3")] = None
    mass_kg: Annotated[float | None, Field(gt=0, description="Mass instead of a density, kg")] = None
    friction: Annotated[float | None, Field(ge=0, description="Coulomb friction coefficient")] = None
    rgba: Annotated[Colour | None, Field(description="Red, green, blue and opacity, each 0 to 1")] = None
