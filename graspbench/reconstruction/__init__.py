"""From silhouettes to a surface: visual hull, preshape ellipsoid, elastic reconstruction surface."""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
    from graspbench.reconstruction.ellipsoid import Ellipsoid
    from graspbench.reconstruction.methods import METHODS, Reconstruction
    from graspbench.reconstruction.network import SurfaceNetwork, build_network
    from graspbench.reconstruction.parameters import SurfaceParameters
    from graspbench.reconstruction.preshaping import preshape
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

_HOMES = {
    "METHODS": "methods",
    "Ellipsoid": "ellipsoid",
    "Progress": "surface",
    "Reconstruction": "methods",
    "Surface": "surface",
    "SurfaceNetwork": "network",
    "SurfaceParameters": "parameters",
    "VisualHull": "visual_hull",
    "build_network": "network",
    "enclosed_solid": "solid",
    "preshape": "preshaping",
    "reconstruct": "selection",
    "vertex_normals": "solid",
}

__getattr__ = loads_on_use(__name__, _HOMES)
