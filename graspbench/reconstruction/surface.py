"""The elastic surface at one moment: what the planners read."""

from dataclasses import dataclass

from graspbench.arrays import FloatArray
from graspbench.reconstruction.network import SurfaceNetwork


@dataclass(frozen=True)
class Surface:
    """A snapshot of the reconstruction surface.

    Attributes:
        points: Node positions in the world, shape (n_s, 3).
        normals: Outward unit normals at the nodes, shape (n_s, 3).
        centroid: Centre of mass of the enclosed solid, shape (3,).
        network: How the nodes are linked; the same object for all snapshots of a reconstruction.
        iteration: Number of integration steps done.
        at_rest: Whether the surface has come to rest.
    """

    points: FloatArray
    normals: FloatArray
    centroid: FloatArray
    network: SurfaceNetwork
    iteration: int
    at_rest: bool
