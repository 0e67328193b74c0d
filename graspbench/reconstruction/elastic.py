"""The elastic reconstruction surface: an ellipsoid that shrinks onto the visual hull (thesis 3.3)."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ReconstructionError
from graspbench.perception.triangulation import triangulate_centre
from graspbench.reconstruction.carving import interior_point
from graspbench.reconstruction.dynamics import Law, State, advance, energy, initial_state, law_of, settle
from graspbench.reconstruction.genus import carried_by
from graspbench.reconstruction.network import SurfaceNetwork
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.preshaping import preshape
from graspbench.reconstruction.refinement import refine
from graspbench.reconstruction.sampling import network_of, sample_ellipsoid
from graspbench.reconstruction.snapshot import snapshot
from graspbench.reconstruction.surface import Progress, Surface
from graspbench.reconstruction.visual_hull import VisualHull

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette


def reconstruct_elastic(
    silhouettes: "Sequence[Silhouette]", parameters: SurfaceParameters, centre: FloatArray | None = None
) -> Iterator[Surface]:
    """Shrink an elastic surface onto the visual hull, yielding it as it moves.

    The work is done lazily, between two snapshots. Every snapshot can be planned on.

    Args:
        silhouettes: Of one object, with ideal pinhole cameras.
        parameters: See `SurfaceParameters`.
        centre: Estimated centroid that the nodes are pulled to, shape (3,); triangulated if absent. If
            it is not well inside the visual hull, the hull's deepest point takes its place.

    Yields:
        The wrapping ellipsoid, then the surface every ``snapshot_every`` steps; the last one rests.

    Raises:
        StationError: The stations do not enclose the object.
        ReconstructionError: There is no visual hull, or the surface does not come to rest.
    """
    silhouettes = carried_by("elastic", silhouettes)
    if centre is None:
        centre = triangulate_centre(silhouettes)
    network, law = network_of(parameters), law_of(parameters)
    hull = None if parameters.wrap == "polyhedron" else _hull_of(silhouettes, parameters)
    ellipsoid = preshape(silhouettes, centre, parameters, hull=hull)
    state = initial_state(sample_ellipsoid(ellipsoid, network, parameters.pole_thinning), len(silhouettes))
    # A planner can begin on the ellipsoid while the hull is made.
    yield snapshot(
        state.points,
        network,
        smoothing=parameters.normal_smoothing,
        progress=_progress(state, law, network),
    )
    hull = hull or _hull_of(silhouettes, parameters)
    target = interior_point(hull, ellipsoid, centre)
    yield from _shrink(hull, state, law, network, target, parameters)


def _hull_of(silhouettes: "Sequence[Silhouette]", parameters: SurfaceParameters) -> VisualHull:
    return VisualHull(silhouettes, parameters.ground, smoothing_px=parameters.smoothing_px)


def _shrink(
    hull: VisualHull,
    state: State,
    law: Law,
    network: SurfaceNetwork,
    target: FloatArray,
    parameters: SurfaceParameters,
) -> Iterator[Surface]:
    """Let the surface move until it rests, then refine it if its pull is to follow the normals."""
    moving = parameters.pull == "normal"
    smoothing = parameters.normal_smoothing
    done = 0
    while state.quiet[0] < parameters.rest_count:
        if done >= parameters.max_iterations:
            raise _restless(state, parameters)
        steps = min(parameters.snapshot_every, parameters.max_iterations - done)
        done += advance(state, law, hull.fields, network.link_start, network.link_nodes, target, steps)
        resting = bool(state.quiet[0] >= parameters.rest_count)
        if resting and parameters.settle:
            settle(state, hull.fields)
        yield snapshot(
            state.points,
            network,
            smoothing=smoothing,
            iteration=done,
            at_rest=resting and not moving,
            progress=_progress(state, law, network),
        )
    if not moving:
        return
    surface = None
    for points in refine(hull, state.points, network, parameters.refinement_steps):
        if surface is not None:
            yield surface
        done += 1
        surface = snapshot(
            points, network, smoothing=smoothing, iteration=done, progress=_progress(state, law, network)
        )
    yield snapshot(
        points,
        network,
        smoothing=smoothing,
        iteration=done,
        at_rest=True,
        progress=_progress(state, law, network),
    )


def _progress(state: State, law: Law, network: SurfaceNetwork) -> Progress:
    return Progress(
        float(energy(state, law, network.link_start, network.link_nodes)),
        int(state.crossings.sum()),
        int(np.count_nonzero(state.crossings)),
        float(state.largest_step[0]),
    )


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
