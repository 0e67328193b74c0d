"""From silhouettes to a surface: visual hull, preshape ellipsoid, elastic reconstruction surface."""

from graspbench.reconstruction.elastic import reconstruct
from graspbench.reconstruction.network import SurfaceNetwork, build_network
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.preshape import Ellipsoid, preshape
from graspbench.reconstruction.surface import Surface
from graspbench.reconstruction.visual_hull import VisualHull

__all__ = [
    "Ellipsoid",
    "Surface",
    "SurfaceNetwork",
    "SurfaceParameters",
    "VisualHull",
    "build_network",
    "preshape",
    "reconstruct",
]
