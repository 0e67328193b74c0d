"""Radial bisection: each node goes straight to the hull's border, without any motion between."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.perception.triangulation import triangulate_centre
from graspbench.reconstruction.carving import interior_point
from graspbench.reconstruction.genus import carried_by
from graspbench.reconstruction.methods import METHODS
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.preshaping import preshape
from graspbench.reconstruction.sampling import network_of, sample_ellipsoid
from graspbench.reconstruction.snapshot import snapshot
from graspbench.reconstruction.surface import Surface
from graspbench.reconstruction.visual_hull import VisualHull

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

BISECTIONS = 20


@METHODS.register("radial")
def reconstruct_radial(
    silhouettes: "Sequence[Silhouette]", parameters: SurfaceParameters, centre: FloatArray | None = None
) -> Iterator[Surface]:
    """Bisect each ray from the centre to the ellipsoid for a point on the hull's border.

    On star-shaped hulls this is where the elastic surface comes to rest. Elsewhere a ray may end on
    any of the borders it crosses.

    Args:
        silhouettes: Of one object, with ideal pinhole cameras.
        parameters: The network, the preshape and the hull are as for the elastic surface.
        centre: Where the rays start, shape (3,); triangulated if absent.

    Yields:
        The wrapping ellipsoid, then the resting surface.

    Raises:
        StationError: The stations do not enclose the object.
        ReconstructionError: There is no visual hull.
    """
    silhouettes = carried_by("radial", silhouettes)
    hull = VisualHull(silhouettes, parameters.ground, smoothing_px=parameters.smoothing_px)
    if centre is None:
        centre = triangulate_centre(silhouettes)
    network = network_of(parameters)
    ellipsoid = preshape(silhouettes, centre, parameters, hull=hull)
    outer = sample_ellipsoid(ellipsoid, network, parameters.pole_thinning)
    yield snapshot(outer, network, smoothing=parameters.normal_smoothing)
    inner = np.tile(interior_point(hull, ellipsoid, centre), (len(outer), 1))
    for _ in range(BISECTIONS):
        middle = 0.5 * (inner + outer)
        inside = hull.contains(middle)[:, None]
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    yield snapshot(
        0.5 * (inner + outer),
        network,
        smoothing=parameters.normal_smoothing,
        iteration=BISECTIONS,
        at_rest=True,
    )
