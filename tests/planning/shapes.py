"""Star-shaped surfaces on the reconstruction network, for the planners' tests."""

from collections.abc import Callable

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.reconstruction.network import build_network
from graspbench.reconstruction.surface import Surface


def directions(meridians: int, parallels: int) -> FloatArray:
    """Unit directions of the nodes, poles at +-z."""
    polar = np.pi * (np.arange(parallels) + 1) / (parallels + 1)
    azimuth = 2 * np.pi * np.arange(meridians) / meridians
    t, p = np.meshgrid(polar, azimuth, indexing="ij")
    ring = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    return np.vstack([[0.0, 0.0, 1.0], ring, [0.0, 0.0, -1.0]])


def surface_of(
    points: FloatArray,
    meridians: int,
    parallels: int,
    *,
    normals: FloatArray | None = None,
    at_rest: bool = True,
) -> Surface:
    """Wrap node positions, normals and centroid from the mesh when not given."""
    network = build_network(meridians, parallels)
    a, b, c = (points[network.faces[:, k]] for k in range(3))
    if normals is None:
        normals = np.zeros_like(points)
        for k in range(3):
            np.add.at(normals, network.faces[:, k], np.cross(b - a, c - a))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    centroid = ((a + b + c) * volume[:, None]).sum(axis=0) / (4 * volume.sum())
    return Surface(points, normals, centroid, network, 0, at_rest)


def ellipsoid(
    semi_axes: tuple[float, float, float], *, meridians: int = 39, parallels: int = 39, at_rest: bool = True
) -> Surface:
    """Ellipsoid with exact normals, metres."""
    d = directions(meridians, parallels)
    axes = np.array(semi_axes)
    normals = d / axes
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return surface_of(d * axes, meridians, parallels, normals=normals, at_rest=at_rest)


def radial(
    radius: Callable[[FloatArray], FloatArray], *, meridians: int = 39, parallels: int = 39
) -> Surface:
    """Surface at distance ``radius(directions)`` from the origin."""
    d = directions(meridians, parallels)
    return surface_of(d * radius(d)[:, None], meridians, parallels)


def shrinking(target: Surface, *, steps: int = 10, margin: float = 1.2) -> list[Surface]:
    """Snapshots from an ellipsoid around ``target`` to ``target``, node by node along rays."""
    d = target.points - target.centroid
    semi = margin * np.abs(d).max(axis=0)
    meridians, parallels = target.network.meridians, target.network.parallels
    scale = 1 / np.linalg.norm(d / semi, axis=1, keepdims=True)
    found = []
    for share in np.linspace(0, 1, steps):
        points = target.centroid + d * (share + (1 - share) * scale)
        found.append(surface_of(points, meridians, parallels, at_rest=False))
    return [*found[:-1], target]


def lifted(surface: Surface, height_m: float) -> Surface:
    """Move a surface up."""
    shift = np.array([0.0, 0.0, height_m])
    return Surface(
        surface.points + shift,
        surface.normals,
        surface.centroid + shift,
        surface.network,
        surface.iteration,
        surface.at_rest,
    )
