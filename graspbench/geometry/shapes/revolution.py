"""Solids of revolution: bottle, cylinder, egg, cone, and any profile of rounded corners."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.outline import rounded_polyline
from graspbench.geometry.revolution import revolved_body
from graspbench.geometry.shapes.registry import register

STEP_M = 4e-3
"""Spacing of profile points on straight stretches; arcs are finer."""

_Corner = Annotated[tuple[float, float], Field(description="Radius and height of a corner, m")]


@register("revolution")
@dataclass(frozen=True)
class Revolution:
    """The solid swept by a profile of straight lines and rounded corners about the z axis."""

    corners_m: Annotated[
        tuple[_Corner, ...],
        Field(min_length=3, description="Corners (r, z) from the axis below to the axis above, m"),
    ]
    radii_m: Annotated[
        tuple[Annotated[float, Field(ge=0)], ...],
        Field(description="Rounding of each inner corner, m; one number less two than corners"),
    ]

    def build(self) -> Body:
        """Return the body, standing on z = its lowest corner."""
        if len(self.radii_m) != len(self.corners_m) - 2:
            raise ConfigurationError(
                f"shape 'revolution' has {len(self.corners_m)} corners and {len(self.radii_m)} radii",
                remedy="give one radius for each corner between the first and the last",
            )
        corners = np.array(self.corners_m)
        return revolved_body(rounded_polyline(corners, (0.0, *self.radii_m, 0.0), STEP_M))


@register("bottle")
@dataclass(frozen=True)
class Bottle:
    """A round bottle with a sloping shoulder and a cylindrical neck."""

    height_m: Annotated[float, Field(gt=0, description="Total height, m")] = 0.15
    diameter_m: Annotated[float, Field(gt=0, description="Diameter of the belly, m")] = 0.06
    neck_diameter_m: Annotated[float, Field(gt=0, description="Diameter of the neck, m")] = 0.026
    neck_height_m: Annotated[float, Field(gt=0, description="Height of the neck, m")] = 0.03
    shoulder_height_m: Annotated[float, Field(gt=0, description="Height between belly and neck, m")] = 0.028

    def build(self) -> Body:
        """Return the body, standing on z = 0."""
        belly, neck = self.diameter_m / 2.0, self.neck_diameter_m / 2.0
        neck_z = self.height_m - self.neck_height_m
        belly_z = neck_z - self.shoulder_height_m
        if neck >= belly or belly_z <= 0.0:
            raise ConfigurationError(
                "shape 'bottle' needs a neck thinner than its belly, and neck and shoulder lower than itself",
                remedy="check neck_diameter_m, neck_height_m and shoulder_height_m",
            )
        corners = np.array(
            [[0, 0], [belly, 0], [belly, belly_z], [neck, neck_z], [neck, self.height_m], [0, self.height_m]]
        )
        bend = min(0.6 * belly, 0.9 * self.shoulder_height_m, 0.9 * self.neck_height_m)
        radii = (0.0, 0.15 * belly, bend, 0.7 * bend, 0.25 * neck, 0.0)
        return revolved_body(rounded_polyline(corners, radii, STEP_M))


@register("cone")
@dataclass(frozen=True)
class Cone:
    """A truncated cone with rounded rims; equal diameters make a cylinder."""

    height_m: Annotated[float, Field(gt=0, description="Height, m")] = 0.1
    bottom_diameter_m: Annotated[float, Field(gt=0, description="Diameter at the bottom, m")] = 0.06
    top_diameter_m: Annotated[float, Field(gt=0, description="Diameter at the top, m")] = 0.06
    edge_radius_m: Annotated[float, Field(ge=0, description="Rounding of both rims, m")] = 0.002

    def build(self) -> Body:
        """Return the body, standing on z = 0."""
        bottom, top = self.bottom_diameter_m / 2.0, self.top_diameter_m / 2.0
        corners = np.array([[0, 0], [bottom, 0], [top, self.height_m], [0, self.height_m]])
        radii = (0.0, self.edge_radius_m, self.edge_radius_m, 0.0)
        return revolved_body(rounded_polyline(corners, radii, STEP_M))


@register("egg")
@dataclass(frozen=True)
class Egg:
    """An egg: an ellipse of revolution whose lower half is wider than its upper one."""

    height_m: Annotated[float, Field(gt=0, description="Length of the long axis, m")] = 0.085
    diameter_m: Annotated[float, Field(gt=0, description="Largest diameter, m")] = 0.06
    taper: Annotated[float, Field(ge=0, lt=0.5, description="0 for an ellipsoid, 0.2 for a hen's egg")] = 0.2

    def build(self) -> Body:
        """Return the body, standing on z = 0: r = b sin(t) (1 + taper cos(t)), z = h (1 - cos(t)) / 2."""
        angle = np.linspace(0.0, np.pi, 49)
        radius = np.sin(angle) * (1.0 + self.taper * np.cos(angle))
        radius *= 0.5 * self.diameter_m / radius.max()
        radius[[0, -1]] = 0.0
        return revolved_body(np.stack([radius, 0.5 * self.height_m * (1.0 - np.cos(angle))], axis=1))
