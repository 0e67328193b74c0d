"""A net with the visual hull's own topology: carved coarse to fine, then relaxed onto the hull."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError, ReconstructionError
from graspbench.perception.triangulation import triangulate_centre
from graspbench.reconstruction.dual_net import extract_net
from graspbench.reconstruction.ellipsoid import moment_ellipsoid, wrap
from graspbench.reconstruction.methods import METHODS
from graspbench.reconstruction.narrow_band import BLOCK_CELLS, BYTES_PER_CELL, NarrowBand, carve, grid_of
from graspbench.reconstruction.network import quad_network
from graspbench.reconstruction.parameters import MAX_NODES, SurfaceParameters
from graspbench.reconstruction.preshaping import polyhedron_vertices
from graspbench.reconstruction.relaxation import LONGEST_STEP, cut_quads, project, relax, tangent_planes
from graspbench.reconstruction.sampling import network_of, sample_ellipsoid
from graspbench.reconstruction.snapshot import snapshot
from graspbench.reconstruction.surface import Surface
from graspbench.reconstruction.visual_hull import VisualHull

MAX_CELLS = 200_000_000
"""Cells of the finest grid."""

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette


@METHODS.register("hull_net")
def reconstruct_hull_net(
    silhouettes: "Sequence[Silhouette]", parameters: SurfaceParameters, centre: FloatArray | None = None
) -> Iterator[Surface]:
    """Extract the visual hull's border as a net, on one grid after the other, each twice as fine.

    Holes of the silhouettes lead through the net. Every surface is one that planners can use; each level
    has a network of its own.

    Args:
        silhouettes: Of one object, with ideal pinhole cameras.
        parameters: `cell_px`, `levels`, `relaxations`, `relaxation_stiffness` and what shapes the hull and
            the first ellipsoid are read.
        centre: Guess of the object's centre, shape (3,); only conditions the numbers.

    Yields:
        The wrapping ellipsoid, then the net of each level; the last one rests. Levels whose cells are coarser
        than the object is thin are passed over.

    Raises:
        ConfigurationError: The finest grid or its net would be too large.
        StationError: The stations do not enclose the object.
        ReconstructionError: There is no visual hull.
    """
    hull = VisualHull(silhouettes, parameters.ground, smoothing_px=parameters.smoothing_px)
    if centre is None:
        centre = triangulate_centre(silhouettes)
    vertices = polyhedron_vertices(silhouettes, centre, ground=parameters.ground)
    around = wrap(moment_ellipsoid(vertices), vertices, parameters.margin)
    network = network_of(parameters)
    yield snapshot(sample_ellipsoid(around, network, parameters.pole_thinning), network)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    finest_m = parameters.cell_px * pixel_size(silhouettes, centre)
    check_grid(low, high, finest_m, parameters)
    for level in range(parameters.levels):
        last = level == parameters.levels - 1
        side_m = finest_m * 2.0 ** (parameters.levels - 1 - level)
        try:
            surface = _level(hull, low, high, side_m, parameters, level + 1, last)
        except ReconstructionError:
            if last:
                raise
            continue  # the object is thinner than these cells
        yield surface


def _level(
    hull: VisualHull,
    low: FloatArray,
    high: FloatArray,
    side_m: float,
    parameters: SurfaceParameters,
    number: int,
    last: bool,
) -> Surface:
    """Return the relaxed net of a grid with cells of one size."""
    band = carve(hull.fields, low, high, side_m)
    _check_net(band, parameters)
    net = extract_net(hull.fields, band)
    planes = tangent_planes(hull.fields, net)
    points, quads, work = net.points, net.quads, np.empty((len(net.points), 4))
    for _ in range(parameters.relaxations):
        relax(points, planes, quads, parameters.relaxation_stiffness, LONGEST_STEP * side_m, work)
    faces = np.empty((2 * len(quads), 3), dtype=np.int64)
    cut_quads(points, planes, quads, faces)
    project(points, hull.fields, LONGEST_STEP * side_m)
    return snapshot(
        points,
        quad_network(quads, faces, len(points)),
        smoothing=parameters.normal_smoothing,
        iteration=number,
        at_rest=last,
    )


def check_grid(low: FloatArray, high: FloatArray, side_m: float, parameters: SurfaceParameters) -> None:
    """Refuse a grid over a box that takes too much memory.

    Args:
        low: Lower corner of the box, shape (3,).
        high: Upper corner, shape (3,).
        side_m: Side of a cell.
        parameters: Whose `cell_px` is to blame.

    Raises:
        ConfigurationError: The message says which cells will do.
    """

    def cells(by: float) -> float:
        _, blocks = grid_of(low, high, by * side_m)
        return float(np.prod(blocks * float(BLOCK_CELLS)))

    if (count := cells(1.0)) > MAX_CELLS:
        memory = f"{count:.2g} cells and {count * BYTES_PER_CELL / 2**30:.0f} GB"
        by = 1.0
        while cells(by) > MAX_CELLS:
            by *= 1.05
        raise _too_fine(f"a grid of {memory}", by, parameters)


def _check_net(band: NarrowBand, parameters: SurfaceParameters) -> None:
    nodes = len(band.cells)  # one or more in each
    if nodes > MAX_NODES:
        raise _too_fine(f"a net of at least {nodes} nodes", 1.05 * (nodes / MAX_NODES) ** 0.5, parameters)


def _too_fine(what: str, by: float, parameters: SurfaceParameters) -> ConfigurationError:
    coarse_enough = math.ceil(100.0 * by * parameters.cell_px) / 100.0
    return ConfigurationError(
        f"surface.cell_px = {parameters.cell_px:g} makes {what} of this object",
        remedy=f"give at least {coarse_enough:g}",
    )


def pixel_size(silhouettes: "Sequence[Silhouette]", centre: FloatArray) -> float:
    """Return the mean size of a pixel at a point (m), over all views."""
    sizes = [float(np.linalg.norm(centre - s.camera.position)) / s.camera.intrinsics.fx for s in silhouettes]
    return float(np.mean(sizes))
