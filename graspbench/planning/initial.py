"""The first grasp on the ellipsoid, before the surface shrinks (thesis 3.4.1)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray, IntArray, cross
from graspbench.reconstruction.surface import Surface

_TILTS_DEG = (0.0, 30.0, 60.0, 90.0)


@dataclass(frozen=True, eq=False)
class InitialGrasp:
    """An equilateral grasp in a plane through the centroid.

    Attributes:
        vertices: Surface nodes, counter-clockwise about `plane_normal`, shape (n_f,).
        plane_normal: Unit normal of the plane, shape (3,).
        plane: Rank of the plane; 0 is the plane of the two minor axes.
        rotation_rad: By how much the grasp is turned in its plane.
    """

    vertices: IntArray
    plane_normal: FloatArray
    plane: int
    rotation_rad: float


def principal_axes(surface: Surface) -> FloatArray:
    """Return the principal axes of the solid inside a surface as columns, longest first, shape (3, 3).

    They are those of the ellipsoid, exactly when the surface still is one.
    """
    faces = surface.network.faces
    a, b, c = (surface.points[faces[:, k]] - surface.centroid for k in range(3))
    volume = np.einsum("ij,ij->i", a, cross(b, c))
    total = a + b + c
    second = sum((x.T @ (volume[:, None] * x) for x in (a, b, c, total)), np.zeros((3, 3)))
    _, vectors = np.linalg.eigh(second)
    axes: FloatArray = vectors[:, ::-1].copy()
    # Fixed signs, so that the same surface always gives the same axes.
    axes *= np.where(axes[np.abs(axes).argmax(axis=0), range(3)] < 0, -1.0, 1.0)
    axes[:, 2] = cross(axes[:, 0], axes[:, 1])
    return axes


def initial_planes(axes: FloatArray) -> FloatArray:
    """Return the normals of the planes to try, best first, shape (n, 3).

    The first is parallel to the two minor axes; the next ones are tilted more and more out of it, ending
    with the planes of the other pairs of axes.

    Args:
        axes: Principal axes as columns, longest first, shape (3, 3).
    """
    normals = [axes[:, 0]]
    for tilt in np.deg2rad(_TILTS_DEG[1:]):
        for sideways in (axes[:, 1], axes[:, 2], -axes[:, 1], -axes[:, 2])[: 4 if tilt < 1.5 else 2]:
            normals.append(np.cos(tilt) * axes[:, 0] + np.sin(tilt) * sideways)
    return np.array(normals)


def equilateral_vertices(
    surface: Surface,
    normal: FloatArray,
    reference: FloatArray,
    n_f: int,
    rotations_rad: FloatArray,
    directions: FloatArray | None = None,
) -> IntArray:
    """Return the nodes nearest to equilateral stars of rays in a plane through the centroid.

    Args:
        surface: A surface that every ray from the centroid leaves once (an ellipsoid does).
        normal: Unit normal of the plane, shape (3,).
        reference: The first ray, before it is turned, lies along this in the plane, shape (3,).
        n_f: Number of contacts.
        rotations_rad: Turns of the star, counter-clockwise about the normal, shape (r,).
        directions: See `directions_from_centroid`; where many stars are asked for they are the same.

    Returns:
        Shape (r, n_f).
    """
    first = reference - (reference @ normal) * normal
    first /= np.linalg.norm(first)
    second = cross(normal, first)
    angles = np.asarray(rotations_rad)[:, None] + 2.0 * np.pi * np.arange(n_f) / n_f
    rays = np.cos(angles)[..., None] * first + np.sin(angles)[..., None] * second
    arms = directions_from_centroid(surface) if directions is None else directions
    vertices: IntArray = np.argmax(rays @ arms.T, axis=-1).astype(np.int64)
    return vertices


def directions_from_centroid(surface: Surface) -> FloatArray:
    """Return unit vectors from the centroid to the nodes, shape (n_s, 3)."""
    arms = surface.points - surface.centroid
    unit: FloatArray = arms / np.sqrt(np.einsum("ij,ij->i", arms, arms))[:, None]
    return unit


def initial_grasps(surface: Surface, n_f: int, rotations: int) -> Iterator[tuple[InitialGrasp, ...]]:
    """Yield the equilateral grasps of one plane after the other, best plane first.

    Args:
        surface: The first surface, an ellipsoid.
        n_f: Number of contacts.
        rotations: Grasps in each plane, evenly turned over 2 pi / n_f.

    Yields:
        The grasps of a plane, at most ``rotations`` of them, nodes all different.
    """
    axes = principal_axes(surface)
    turns = 2.0 * np.pi / n_f * np.arange(rotations) / rotations
    directions = directions_from_centroid(surface)
    for plane, normal in enumerate(initial_planes(axes)):
        reference = axes[:, 2] if abs(axes[:, 2] @ normal) < 0.9 else axes[:, 0]
        found = equilateral_vertices(surface, normal, reference, n_f, turns, directions)
        yield tuple(
            InitialGrasp(vertices, normal, plane, float(turn))
            for vertices, turn in zip(found, turns, strict=True)
            if len(set(vertices.tolist())) == n_f
        )
