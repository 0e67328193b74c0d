"""Superquadrics: spheres, ellipsoids, rounded boxes, pillows, octahedra and what lies between."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import hull_mesh
from graspbench.geometry.mesh import make_mesh
from graspbench.geometry.shapes.registry import register
from graspbench.geometry.star_surface import cube_sphere

_Length = Annotated[float, Field(gt=0)]
_CELLS = 24


@register("superquadric")
@dataclass(frozen=True)
class Superquadric:
    """The solid (|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) <= 1 (Barr 1981)."""

    size_m: Annotated[
        tuple[_Length, _Length, _Length], Field(description="Lengths 2a, 2b, 2c along x, y, z, m")
    ] = (0.06, 0.06, 0.06)
    vertical_exponent: Annotated[
        float, Field(ge=0.1, le=3, description="e1: 0.2 flat top, 1 round, 2 pointed; concave above 2")
    ] = 1.0
    horizontal_exponent: Annotated[
        float, Field(ge=0.1, le=3, description="e2: 0.2 square, 1 round, 2 diamond; concave above 2")
    ] = 1.0

    def build(self) -> Body:
        """Return the body around its centre."""
        rays, faces = cube_sphere(_CELLS)
        vertices = self._on_surface(rays)
        convex = max(self.vertical_exponent, self.horizontal_exponent) <= 2.0
        return Body(make_mesh(vertices, faces), (hull_mesh(vertices),) if convex else None)

    def _on_surface(self, rays: FloatArray) -> FloatArray:
        """Scale rays, shape (n, 3), in units of the semi-axes: the implicit function is homogeneous."""
        e1, e2 = self.vertical_exponent, self.horizontal_exponent
        x, y, z = np.abs(rays).T
        value = (x ** (2.0 / e2) + y ** (2.0 / e2)) ** (e2 / e1) + z ** (2.0 / e1)
        points: FloatArray = rays * (value ** (-e1 / 2.0))[:, None] * (0.5 * np.array(self.size_m))
        return points
