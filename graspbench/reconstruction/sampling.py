"""Where the sample points of the reconstruction surface start on the ellipsoid (thesis 3.3.1)."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.reconstruction.ellipsoid import Ellipsoid
from graspbench.reconstruction.network import SphereNetwork, build_network
from graspbench.reconstruction.parameters import SurfaceParameters


def network_of(parameters: SurfaceParameters) -> SphereNetwork:
    """Return the network for the wanted number of nodes: as many meridians as parallels."""
    side = max(3, round(np.sqrt(parameters.nodes - 2)))
    return build_network(parameters.meridians or side, parameters.parallels or side)


def sample_ellipsoid(ellipsoid: Ellipsoid, network: SphereNetwork, pole_thinning: float) -> FloatArray:
    """Return the nodes on the ellipsoid, poles at the ends of its longest axis, shape (n_s, 3).

    Args:
        ellipsoid: The preshape.
        network: Its meridians run from pole to pole; its parallels lie in planes of the minor axes.
        pole_thinning: 0 spaces the parallels evenly in angle, which crowds the poles; 1 evenly in area.
    """
    fraction = np.arange(1, network.parallels + 1) / (network.parallels + 1)
    polar = (1.0 - pole_thinning) * np.pi * fraction + pole_thinning * np.arccos(1.0 - 2.0 * fraction)
    azimuth = 2.0 * np.pi * np.arange(network.meridians) / network.meridians
    ring = np.column_stack((np.zeros_like(azimuth), np.cos(azimuth), np.sin(azimuth)))
    pole = np.array([1.0, 0.0, 0.0])
    rows = np.cos(polar)[:, None, None] * pole + np.sin(polar)[:, None, None] * ring
    unit = np.vstack((pole, rows.reshape(-1, 3), -pole))
    points: FloatArray = ellipsoid.centre + (unit * ellipsoid.semi_axes) @ ellipsoid.axes.T
    return points
