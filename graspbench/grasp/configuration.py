"""A grasp: where the fingers touch the surface, and the hand that does it."""

from dataclasses import dataclass

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.posture import HandPosture


@dataclass(frozen=True)
class Grasp:
    """A grasp configuration on a reconstruction surface (thesis 3.4).

    Attributes:
        vertices: Surface nodes of the contacts, shape (n_f,).
        points: Contact points in the world, shape (n_f, 3).
        normals: Outward unit surface normals at the contacts, shape (n_f, 3).
        centroid: Centroid of the surface, shape (3,).
        posture: The hand holding it; None while the hand is not considered.
    """

    vertices: IntArray
    points: FloatArray
    normals: FloatArray
    centroid: FloatArray
    posture: HandPosture | None = None
