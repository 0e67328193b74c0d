"""The elastic reconstruction surface: an ellipsoid that shrinks onto the visual hull (thesis 3.3)."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError
from graspbench.perception.triangulation import triangulate_centre
from graspbench.reconstruction.dynamics import State, advance, initial_state, law_of, settle
from graspbench.reconstruction.network import SurfaceNetwork
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.preshape import preshape
from graspbench.reconstruction.sampling import network_of, sample_ellipsoid
from graspbench.reconstruction.solid import enclosed_solid, vertex_normals
from graspbench.reconstruction.surface import Surface
from graspbench.reconstruction.visual_hull import VisualHull

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette


def reconstruct(
    silhouettes: "Sequence[Silhouette]",
    parameters: SurfaceParameters,
    *,
    centre: FloatArray | None = None,
) -> Iterator[Surface]:
    """Shrink an elastic surface onto the visual hull, yielding it as it moves.

    The work is done lazily, between two snapshots. Every snapshot can be planned on.

    Args:
        silhouettes: Of one object, with ideal pinhole cameras.
        parameters: See `SurfaceParameters`.
        centre: Estimated centroid that the nodes are pulled to, shape (3,); triangulated if absent.

    Yields:
        The wrapping ellipsoid, then the surface every ``snapshot_every`` steps; the last one rests.

    Raises:
        StationError: The stations do not enclose the object.
        ReconstructionError: There is no visual hull, or the surface does not come to rest.
    """
    hull = VisualHull(silhouettes, parameters.ground, smoothing_px=parameters.smoothing_px)
    if centre is None:
        centre = triangulate_centre(silhouettes)
    network = network_of(parameters)
    ellipsoid = preshape(silhouettes, centre, parameters)
    state = initial_state(sample_ellipsoid(ellipsoid, network, parameters.pole_thinning), len(silhouettes))
    law = law_of(parameters)
    yield snapshot(state.points, network, 0, at_rest=False, parameters=parameters)
    done = 0
    while done < parameters.max_iterations:
        steps = min(parameters.snapshot_every, parameters.max_iterations - done)
        done += advance(state, law, hull.fields, network.link_start, network.link_nodes, centre, steps)
        if state.quiet[0] >= parameters.rest_count:
            if parameters.settle:
                settle(state, hull.fields)
            yield snapshot(state.points, network, done, at_rest=True, parameters=parameters)
            return
        yield snapshot(state.points, network, done, at_rest=False, parameters=parameters)
    raise _restless(state, parameters)


def snapshot(
    points: FloatArray,
    network: SurfaceNetwork,
    iteration: int,
    *,
    at_rest: bool,
    parameters: SurfaceParameters,
) -> Surface:
    """Return the surface that a planner reads."""
    if not np.isfinite(points).all():
        raise ReconstructionError(
            f"the surface diverged after {iteration} steps",
            remedy="take a smaller time step, softer springs or the velocity_reset dynamics",
        )
    _, centroid = enclosed_solid(points, network)
    normals = vertex_normals(points, network, smoothing=parameters.normal_smoothing)
    return Surface(points.copy(), normals, centroid, network, iteration, at_rest)


def _restless(state: State, parameters: SurfaceParameters) -> ReconstructionError:
    """Return the error that says why the surface is not at rest."""
    missed = int(np.count_nonzero(state.crossings == 0))
    why = (
        f"{missed} of {len(state.points)} nodes never reached the visual hull"
        if missed
        else f"nodes still move {1e3 * state.largest_step[0]:.3g} mm a step"
    )
    return ReconstructionError(
        f"the surface is not at rest after {parameters.max_iterations} steps, {why}",
        remedy="raise surface.max_iterations or surface.time_step_s, or check the centre and the silhouettes",
        missed=missed,
        largest_step_m=float(state.largest_step[0]),
    )
