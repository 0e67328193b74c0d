"""Convex pieces of a mesh, for contact dynamics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from graspbench.geometry.convex_union import hull_mesh
from graspbench.geometry.mesh import signed_volume

if TYPE_CHECKING:
    import trimesh

_CONVEX_SHARE = 0.995
"""A body that fills this share of its convex hull is taken as convex."""


def convex_parts(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, ...]:
    """Return convex meshes whose union approximates a closed mesh, m."""
    vertices = np.asarray(mesh.vertices)
    hull = hull_mesh(vertices)
    share = signed_volume(vertices, np.asarray(mesh.faces)) / signed_volume(hull.vertices, hull.faces)
    if share >= _CONVEX_SHARE:
        return (hull,)
    return (hull,)
