"""Prisms: regular, star-shaped, or over any outline with rounded corners."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.extrusion import extruded_body
from graspbench.geometry.outline import rounded_polyline
from graspbench.geometry.shapes.registry import register

_STEP_M = 4e-3

_Corner = Annotated[tuple[float, float], Field(description="x and y of a corner, m")]


@register("prism")
@dataclass(frozen=True)
class Prism:
    """A regular prism with smooth lateral corners; with inner corners, a star (three sides: thesis A.3)."""

    sides: Annotated[int, Field(ge=3, le=24, description="Number of sides, or of the star's points")] = 3
    height_m: Annotated[float, Field(gt=0, description="Height, m")] = 0.08
    circumradius_m: Annotated[
        float, Field(gt=0, description="Distance of the corners from the axis before rounding, m")
    ] = 0.05
    inner_radius_m: Annotated[
        float | None,
        Field(gt=0, description="Distance of a star's inner corners from the axis, m; null for none"),
    ] = None
    corner_radius_m: Annotated[float, Field(ge=0, description="Rounding of the lateral corners, m")] = 0.012
    rim_radius_m: Annotated[float, Field(ge=0, description="Rounding of the bottom's and top's rims, m")] = (
        0.003
    )

    def build(self) -> Body:
        """Return the body, standing on z = 0."""
        angles = 2.0 * np.pi * np.arange(self.sides) / self.sides
        corners = self.circumradius_m * _on_circle(angles)
        if self.inner_radius_m is not None:
            if self.inner_radius_m >= self.circumradius_m:
                raise ConfigurationError(
                    "shape 'prism' has its inner corners outside",
                    remedy="use inner_radius_m < circumradius_m",
                )
            inner = self.inner_radius_m * _on_circle(angles + np.pi / self.sides)
            corners = np.stack([corners, inner], axis=1).reshape(-1, 2)
        outline = rounded_polyline(corners, [self.corner_radius_m] * len(corners), _STEP_M, closed=True)
        return extruded_body(outline, self.height_m, self.rim_radius_m, _STEP_M)


@register("extrusion")
@dataclass(frozen=True)
class Extrusion:
    """A prism over any simple outline with rounded corners."""

    corners_m: Annotated[
        tuple[_Corner, ...], Field(min_length=3, description="Counter-clockwise corners of the outline, m")
    ]
    height_m: Annotated[float, Field(gt=0, description="Height, m")] = 0.06
    corner_radius_m: Annotated[float, Field(ge=0, description="Rounding of the lateral corners, m")] = 0.006
    rim_radius_m: Annotated[float, Field(ge=0, description="Rounding of the bottom's and top's rims, m")] = (
        0.003
    )

    def build(self) -> Body:
        """Return the body, standing on z = 0."""
        corners = np.array(self.corners_m)
        x, y = corners.T
        if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) <= 0.0:
            raise ConfigurationError(
                "the outline of an extrusion runs clockwise", remedy="reverse the order of corners_m"
            )
        outline = rounded_polyline(corners, [self.corner_radius_m] * len(corners), _STEP_M, closed=True)
        return extruded_body(outline, self.height_m, self.rim_radius_m, _STEP_M)


def _on_circle(angles: FloatArray) -> FloatArray:
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)
