"""Turning nodes into the surface that planners read."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError
from graspbench.reconstruction.network import SurfaceNetwork
from graspbench.reconstruction.solid import enclosed_solid, vertex_normals
from graspbench.reconstruction.surface import Progress, Surface


def snapshot(
    points: FloatArray,
    network: SurfaceNetwork,
    *,
    smoothing: int = 0,
    iteration: int = 0,
    at_rest: bool = False,
    progress: Progress | None = None,
) -> Surface:
    """Return a surface with its normals and centroid; the points are copied.

    Args:
        points: Node positions, shape (n_s, 3).
        network: How they are linked.
        smoothing: Averaging passes over the normals.
        iteration: Number of steps done.
        at_rest: Whether the surface rests.
        progress: Counters of its motion.

    Raises:
        ReconstructionError: A position is not a finite number.
    """
    if not np.isfinite(points).all():
        raise ReconstructionError(
            f"the surface diverged within {iteration} steps",
            remedy="take a smaller surface.time_step_s, softer springs or the velocity_reset dynamics",
            iteration=iteration,
        )
    _, centroid = enclosed_solid(points, network)
    normals = vertex_normals(points, network, smoothing=smoothing)
    return Surface(points.copy(), normals, centroid, network, iteration, at_rest, progress)
