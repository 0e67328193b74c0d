"""Bodies with lobes around a vertical axis."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.geometry.body import Body
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.revolution import ring_faces
from graspbench.geometry.shapes.registry import register

_AROUND, _UP = 96, 40


@register("lobed")
@dataclass(frozen=True)
class Lobed:
    """A rounded, tapered body with a lobed cross-section.

    Radius at height h in [-1, 1] and angle t: R (1 - taper h) (1 + depth cos(lobes t)) (1 - |h|^s)^(1/s).
    Three lobes give a grasp with three fingers in the valleys whose normals are 120 deg apart.
    """

    height_m: Annotated[float, Field(gt=0, description="Height, m")] = 0.09
    diameter_m: Annotated[float, Field(gt=0, description="Mean diameter at half height, m")] = 0.07
    lobes: Annotated[int, Field(ge=2, le=8, description="Number of lobes")] = 3
    depth: Annotated[float, Field(ge=0, le=0.3, description="Relative height of the lobes")] = 0.12
    taper: Annotated[float, Field(ge=0, le=0.5, description="Relative change of the radius to each end")] = (
        0.15
    )
    squareness: Annotated[
        float, Field(ge=1.5, le=8, description="s: 2 for an ellipse, 4 for flatter ends")
    ] = 3.0

    def build(self) -> Body:
        """Return the body around its centre."""
        slope = np.linspace(0.0, np.pi, _UP + 1)[1:-1]
        # Points of the superellipse in even steps of its angle: rows get closer where it bends.
        height = -np.sign(np.cos(slope)) * np.abs(np.cos(slope)) ** (2.0 / self.squareness)
        radius = np.sin(slope) ** (2.0 / self.squareness) * (1.0 - self.taper * height)
        angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
        section = 0.5 * self.diameter_m * (1.0 + self.depth * np.cos(self.lobes * angles))
        rings = np.stack(
            [
                radius[:, None] * section * np.cos(angles),
                radius[:, None] * section * np.sin(angles),
                np.broadcast_to(0.5 * self.height_m * height[:, None], (len(height), _AROUND)),
            ],
            axis=-1,
        )
        poles = np.array([[0.0, 0.0, -0.5 * self.height_m], [0.0, 0.0, 0.5 * self.height_m]])
        vertices = np.concatenate([poles, rings.reshape(-1, 3)])
        return Body(make_mesh(vertices, ring_faces(len(height), _AROUND)), None)
