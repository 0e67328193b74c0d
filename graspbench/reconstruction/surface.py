"""The elastic surface at one moment: what the planners read."""

from dataclasses import dataclass

from graspbench.arrays import FloatArray
from graspbench.reconstruction.network import SurfaceNetwork


@dataclass(frozen=True)
class Progress:
    """How far the motion of a surface has come.

    Attributes:
        energy_j: Kinetic energy of the nodes and elastic energy of the links.
        crossings: How often nodes crossed the visual hull's border so far, all nodes together.
        crossed_nodes: How many nodes crossed it at least once.
        largest_step_m: Largest motion of a node in the last step.
    """

    energy_j: float
    crossings: int
    crossed_nodes: int
    largest_step_m: float


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
        progress: Counters of its motion; None from a reconstruction that does not move.
    """

    points: FloatArray
    normals: FloatArray
    centroid: FloatArray
    network: SurfaceNetwork
    iteration: int
    at_rest: bool
    progress: Progress | None = None
