"""From silhouettes to a surface: visual hull, preshape ellipsoid, elastic reconstruction surface."""

from graspbench.reconstruction.ellipsoid import Ellipsoid
from graspbench.reconstruction.methods import METHODS, Reconstruction
from graspbench.reconstruction.network import SurfaceNetwork, build_network
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.preshape import preshape
from graspbench.reconstruction.selection import reconstruct
from graspbench.reconstruction.solid import enclosed_solid, vertex_normals
from graspbench.reconstruction.surface import Progress, Surface
from graspbench.reconstruction.visual_hull import VisualHull

__all__ = [
    "METHODS",
    "Ellipsoid",
    "Progress",
    "Reconstruction",
    "Surface",
    "SurfaceNetwork",
    "SurfaceParameters",
    "VisualHull",
    "build_network",
    "enclosed_solid",
    "preshape",
    "reconstruct",
    "vertex_normals",
]
