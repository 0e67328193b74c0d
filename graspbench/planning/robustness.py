"""How good a grasp still is when its contacts are not quite where they were planned (beyond the thesis).

The best grasp by an index is seldom the one that forgives most (Weisz and Allen 2012). Here each contact is
moved along the surface, its normal tilted and the friction changed, all by normally distributed errors, and
Q3 is taken again. Near an edge, a rim or a thin wall a small error of position brings another normal or
another place altogether, so that such contacts count for little. All grasps meet the same errors.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from graspbench.arrays import FloatArray, IntArray
from graspbench.grasp.contact import contact_tangents
from graspbench.grasp.quality import QualityParameters, grasp_quality
from graspbench.planning.parameters import RobustParameters
from graspbench.reconstruction.surface import Surface

_FRICTION_LEVELS = (-1.2247, 0.0, 1.2247)
"""Standard deviations with the mean and the variance of a normal distribution, in equal shares."""

_SAME_SIDE = 0.3
_NEIGHBOURS = 12


class Robustness:
    """Measures grasps on one surface.

    Args:
        surface: The surface at rest.
        quality: How Q3 is measured.
        parameters: Which errors.

    Attributes:
        surface: The surface.
    """

    def __init__(self, surface: Surface, quality: QualityParameters, parameters: RobustParameters) -> None:
        self.surface, self._quality, self._parameters = surface, quality, parameters
        self._length_m = quality.torque_length_m(surface.points, surface.centroid)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.surface.points)

    def expected_q3(self, vertices: IntArray) -> float:
        """Return the mean of Q3 under the errors; grasps that are not force closure count as 0.

        Args:
            vertices: The contacts, shape (n_f,).
        """
        values = self.samples_q3(vertices)
        return float(values.mean())

    def samples_q3(self, vertices: IntArray) -> FloatArray:
        """Return Q3 under each of the errors, shape (samples,); vertices of shape (n_f,)."""
        p, surface = self._parameters, self.surface
        random = np.random.default_rng(p.seed)
        shifts, tilts = random.standard_normal((2, p.samples, len(vertices), 2))
        points, normals = self._moved(vertices, p.position_sigma_m * shifts)
        normals = _tilted(points, normals, surface.centroid, np.radians(p.normal_sigma_deg) * tilts)
        values = np.empty(p.samples)
        for k, level in enumerate(_FRICTION_LEVELS):
            part = slice(k, None, len(_FRICTION_LEVELS))
            friction = self._quality.friction * (1.0 + p.friction_sigma * level)
            chosen = replace(self._quality, friction=friction)
            values[part] = grasp_quality(
                points[part],
                -normals[part],
                surface.centroid,
                contact=chosen.contact,
                wrench_space=chosen.wrench_space,
                friction=chosen.friction,
                cone_edges=chosen.cone_edges,
                torque_length=self._length_m,
                torsional_friction=chosen.torsion(self._length_m),
                norm=chosen.norm,
            ).q3
        return values

    def _moved(self, vertices: IntArray, shifts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Move contacts along the surface by shifts in their tangent planes, shape (samples, n_f, 2).

        Returns:
            Points and outward normals there, shape (samples, n_f, 3) each.
        """
        surface = self.surface
        points, normals = surface.points[vertices], surface.normals[vertices]
        tangents = contact_tangents(points, -normals, surface.centroid)
        wanted = points + shifts[..., :1] * tangents + shifts[..., 1:] * np.cross(normals, tangents)
        count = min(_NEIGHBOURS, len(surface.points))
        _, near = self._tree.query(wanted, k=count)
        near = near.reshape(*wanted.shape[:2], count)
        # The other side of a thin wall is nearer than it can be reached.
        same = np.einsum("snkc,nc->snk", surface.normals[near], normals) > _SAME_SIDE
        first = np.take_along_axis(near, same.argmax(axis=2)[..., None], axis=2)[..., 0]
        chosen = np.where(same.any(axis=2), first, vertices)
        return surface.points[chosen], surface.normals[chosen]


def _tilted(points: FloatArray, normals: FloatArray, centre: FloatArray, angles: FloatArray) -> FloatArray:
    """Tilt unit normals, shape (..., 3), towards both tangents by angles, shape (..., 2), rad."""
    tangents = contact_tangents(points, -normals, centre)
    steep = np.tan(angles)
    tilted = normals + steep[..., :1] * tangents + steep[..., 1:] * np.cross(normals, tangents)
    unit: FloatArray = tilted / np.linalg.norm(tilted, axis=-1, keepdims=True)
    return unit
