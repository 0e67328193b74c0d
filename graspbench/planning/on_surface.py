"""Grasps at nodes of a surface."""

from graspbench.arrays import IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.posture import HandPosture
from graspbench.reconstruction.surface import Surface


def grasp_at(surface: Surface, vertices: IntArray, posture: HandPosture | None) -> Grasp:
    """Return the grasp at some vertices of a surface, shape (n_f,)."""
    return Grasp(
        vertices=vertices,
        points=surface.points[vertices],
        normals=surface.normals[vertices],
        centroid=surface.centroid,
        posture=posture,
    )
