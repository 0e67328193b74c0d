"""A drinking glass."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import hull_mesh
from graspbench.geometry.outline import rounded_polyline
from graspbench.geometry.revolution import SEGMENTS, surface_of_revolution
from graspbench.geometry.shapes.registry import register

_STEP_M = 4e-3
_SECTORS = 16


@register("glass")
@dataclass(frozen=True)
class Glass:
    """A conical tumbler with a thick bottom; its cavity is open above, so its genus is 0.

    No silhouette shows the cavity: the visual hull of a glass is a full one.
    """

    height_m: Annotated[float, Field(gt=0, description="Height, m")] = 0.1
    bottom_diameter_m: Annotated[float, Field(gt=0, description="Outer diameter at the bottom, m")] = 0.054
    top_diameter_m: Annotated[float, Field(gt=0, description="Outer diameter at the rim, m")] = 0.068
    wall_m: Annotated[float, Field(gt=0, description="Thickness of the wall, m")] = 0.004
    bottom_m: Annotated[float, Field(gt=0, description="Thickness of the bottom, m")] = 0.012

    def build(self) -> Body:
        """Return the body, standing on z = 0."""
        outer, rim = self.bottom_diameter_m / 2.0, self.top_diameter_m / 2.0
        inner = outer + (rim - outer) * self.bottom_m / self.height_m - self.wall_m
        if inner <= 2.0 * self.wall_m or self.bottom_m >= 0.9 * self.height_m:
            raise ConfigurationError(
                "shape 'glass' has no room for its cavity", remedy="use a smaller wall_m or bottom_m"
            )
        corners = np.array(
            [
                [0, 0],
                [outer, 0],
                [rim, self.height_m],
                [rim - self.wall_m, self.height_m],
                [inner, self.bottom_m],
                [0, self.bottom_m],
            ]
        )
        round_rim = 0.3 * self.wall_m
        radii = (0.0, 0.5 * self.wall_m, round_rim, round_rim, self.wall_m, 0.0)
        profile = rounded_polyline(corners, radii, _STEP_M)
        mesh = surface_of_revolution(profile)
        rings = np.asarray(mesh.vertices)[2:].reshape(-1, SEGMENTS, 3)
        heights = profile[1:-1, 1]
        top = int(np.argmax(heights))
        seam = int(np.flatnonzero(heights[:top] <= self.bottom_m)[-1])  # the wall starts where the base ends
        base = rings[heights <= self.bottom_m + 1e-9]
        wall = np.concatenate([rings[seam:top], rings[top:][heights[top:] > self.bottom_m + 1e-9]])
        width = SEGMENTS // _SECTORS
        around = np.arange(SEGMENTS + 1) % SEGMENTS
        sectors = (wall[:, around[k * width : (k + 1) * width + 1]] for k in range(_SECTORS))
        return Body(
            mesh, (hull_mesh(base.reshape(-1, 3)), *(hull_mesh(sector.reshape(-1, 3)) for sector in sectors))
        )
