"""How far a hand is from touching a surface well: the contact energy of GraspIt!'s eigengrasp planner."""

import numpy as np
from scipy.spatial import cKDTree

from graspbench.arrays import FloatArray, IntArray
from graspbench.reconstruction.surface import Surface

DISTANCE_M = 0.02
"""A tip so far from the surface costs as much as one that pushes at a right angle to the normal."""


class ContactEnergy:
    """Distances of fingertips to a surface, and how they would push on it.

    Each tip adds its distance to the surface and one minus the cosine of the angle between the inward normal
    there and the direction in which it would push: to the middle of all tips (Ciocarlie and Allen 2009,
    whose pads have a normal of their own; a spherical tip has none).

    Args:
        surface: The finished surface.
        tip_radius_m: Radius of the fingertips.
    """

    def __init__(self, surface: Surface, tip_radius_m: float) -> None:
        self._surface, self._radius = surface, tip_radius_m
        self._tree = cKDTree(surface.points)

    def __call__(self, tips: FloatArray) -> tuple[float, IntArray]:
        """Return the energy of tips at these centres, shape (n_f, 3), m, and the nodes nearest to them.

        Returns:
            Energy, 0 where all tips touch and push along the normals; nodes, shape (n_f,).
        """
        _, nearest = self._tree.query(tips)
        nodes = np.asarray(nearest, dtype=np.int64)
        points, normals = self._surface.points[nodes], self._surface.normals[nodes]
        # Along the normal and across it: a tip inside the surface is not near.
        gaps = tips - (points + self._radius * normals)
        pushes = tips.mean(axis=0) - tips
        pushes /= np.maximum(np.linalg.norm(pushes, axis=1, keepdims=True), 1e-9)
        aligned = -np.einsum("ij,ij->i", pushes, normals)
        energy = np.linalg.norm(gaps, axis=1) / DISTANCE_M + 1.0 - aligned
        return float(energy.mean()), nodes
