"""A tapered tube along an arc, such as a banana."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import hull_mesh
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.revolution import ring_faces
from graspbench.geometry.shapes.registry import register

_AROUND, _ALONG, _PARTS = 48, 60, 8


@register("bent_tube")
@dataclass(frozen=True)
class BentTube:
    """A tube of round section about an arc in the horizontal plane, thinner towards both ends."""

    length_m: Annotated[float, Field(gt=0, description="Length along the arc, m")] = 0.13
    diameter_m: Annotated[float, Field(gt=0, description="Largest diameter, m")] = 0.036
    bend_deg: Annotated[float, Field(gt=1, le=180, description="Angle of the arc, deg")] = 70.0
    bluntness: Annotated[
        float, Field(ge=2, le=8, description="2 for an ellipse's taper, 4 for blunt ends")
    ] = 3.0

    def build(self) -> Body:
        """Return the body; the arc's middle is at the origin."""
        bend = math.radians(self.bend_deg)
        arc_radius = self.length_m / bend
        if arc_radius <= 0.5 * self.diameter_m:
            raise ConfigurationError(
                "shape 'bent_tube' is bent more sharply than it is thick", remedy="use a smaller bend_deg"
            )
        # Even steps of the superellipse's angle: rings get closer towards the ends.
        slope = np.linspace(0.0, np.pi, _ALONG + 1)
        power = 2.0 / self.bluntness
        along = -np.sign(np.cos(slope)) * np.abs(np.cos(slope)) ** power
        thickness = 0.5 * self.diameter_m * np.abs(np.sin(slope)) ** power
        turn = 0.5 * bend * along
        axis = np.stack([arc_radius * np.sin(turn), arc_radius * (np.cos(turn) - 1.0), 0.0 * turn], axis=1)
        across = np.stack([np.sin(turn), np.cos(turn), 0.0 * turn], axis=1)
        angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
        section = np.cos(angles)[:, None] * across[1:-1, None] + np.sin(angles)[:, None] * np.array(
            [0.0, 0, 1]
        )
        rings: FloatArray = axis[1:-1, None] + thickness[1:-1, None, None] * section
        vertices = np.concatenate([axis[[0, -1]], rings.reshape(-1, 3)])
        cuts = np.linspace(0, len(rings) - 1, _PARTS + 1).round().astype(int)
        parts = [rings[a : b + 1].reshape(-1, 3) for a, b in pairwise(cuts)]
        parts[0] = np.concatenate([axis[:1], parts[0]])
        parts[-1] = np.concatenate([axis[-1:], parts[-1]])
        mesh = make_mesh(vertices, ring_faces(len(rings), _AROUND))
        return Body(mesh, tuple(hull_mesh(part) for part in parts))
