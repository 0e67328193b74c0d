"""Contact wrenches: how contact forces act on the object."""

from typing import Literal, TypeAlias

import numpy as np

from graspbench.arrays import FloatArray, cross
from graspbench.errors import ConfigurationError
from graspbench.grasp.contact import WITH_TORSION, ContactModel, contact_tangents, perpendicular

WrenchSpace: TypeAlias = Literal["spatial", "planar", "spatial_force", "planar_force"]

WRENCH_SPACES: tuple[WrenchSpace, ...] = ("spatial", "planar", "spatial_force", "planar_force")


def auto_torque_length(points: FloatArray, centre: FloatArray) -> float:
    """Return the largest distance from the centre to the surface points, shape (n, 3), m."""
    return float(np.linalg.norm(points - centre, axis=-1).max())


def grasp_plane_normal(points: FloatArray, normals_in: FloatArray) -> FloatArray:
    """Return the unit normal of each grasp's plane.

    The plane is the least squares plane of the contacts. Where they lie on a line (two contacts
    always do) it is the plane through that line which is closest to the contact normals, and
    where those are along the line too, any fixed one.

    Args:
        points: Contact points, shape (..., n_f, 3).
        normals_in: Unit contact normals, shape (..., n_f, 3).

    Returns:
        Shape (..., 3); its largest component is positive, so it does not depend on the contacts' order.
        The sign decides where a friction cone with an odd number of edges begins; else it is of no meaning.
    """
    offsets = points - points.mean(axis=-2, keepdims=True)
    _, spread, axes = np.linalg.svd(offsets, full_matrices=True)
    normal = axes[..., 2, :].copy()
    second = spread[..., 1] if spread.shape[-1] > 1 else np.zeros(spread.shape[:-1])
    collinear = second <= 1e-9 * np.maximum(spread[..., 0], 1e-300)
    for index in np.ndindex(collinear.shape):
        if collinear[index]:
            normal[index] = _plane_through_line(axes[index][0], normals_in[index])
    largest = np.argmax(np.abs(normal), axis=-1, keepdims=True)
    return np.asarray(normal * np.where(np.take_along_axis(normal, largest, axis=-1) < 0.0, -1.0, 1.0))


def wrench_projection(wrench_space: WrenchSpace, plane_normal: FloatArray | None = None) -> FloatArray:
    """Return the matrix with orthonormal rows that projects spatial wrenches to a wrench space.

    Args:
        wrench_space: ``spatial`` (3 forces, 3 moments), ``planar`` (2 forces in the grasp plane, the
            moment about its normal), or ``spatial_force`` and ``planar_force``, their forces alone.
        plane_normal: Unit normals of the grasp planes, shape (..., 3); needed by the planar ones.

    Returns:
        Shape (d, 6), or (..., d, 6) for the planar ones.

    Raises:
        ConfigurationError: The wrench space is unknown.
    """
    if wrench_space == "spatial":
        return np.eye(6)
    if wrench_space == "spatial_force":
        return np.eye(6)[:3]
    if wrench_space not in WRENCH_SPACES or plane_normal is None:
        raise ConfigurationError(
            f"unknown wrench space '{wrench_space}'", remedy=f"choose one of {', '.join(WRENCH_SPACES)}"
        )
    first = perpendicular(plane_normal)
    rows = np.zeros((*plane_normal.shape[:-1], 3 if wrench_space == "planar" else 2, 6))
    rows[..., 0, :3] = first
    rows[..., 1, :3] = cross(plane_normal, first)
    if wrench_space == "planar":
        rows[..., 2, 3:] = plane_normal
    return rows


def wrench_maps(
    points: FloatArray,
    normals_in: FloatArray,
    centre: FloatArray,
    *,
    contact: ContactModel = "hard_finger",
    wrench_space: WrenchSpace = "spatial",
    torque_length: float = 1.0,
    tangents: FloatArray | None = None,
) -> FloatArray:
    """Return each contact's map from its force basis to the wrench space.

    Wrenches are [force; moment about the centre / torque length]; all lengths are thereby measured in
    torque lengths, and so is the unit moment of a soft finger or pad.

    Args:
        points: Contact points, shape (..., n_f, 3), m.
        normals_in: Unit normals pointing into the object, shape (..., n_f, 3).
        centre: Centre of the moments, shape (3,), m.
        contact: Contact model; its basis is that of `ContactPolytope`.
        wrench_space: See `wrench_projection`.
        torque_length: m.
        tangents: First tangent of each contact, shape (..., n_f, 3) or, with a second one which is
            not needed, (..., n_f, 2, 3). By default the rule of `contact_tangents`; in a planar wrench
            space the tangent that lies in the grasp plane.

    Returns:
        Shape (..., n_f, d, n_basis).
    """
    plane = grasp_plane_normal(points, normals_in) if wrench_space.startswith("planar") else None
    basis = _force_basis(points, normals_in, centre, contact, plane, tangents)
    arms = ((points - centre) / torque_length)[..., None, :]
    maps = np.concatenate([basis, cross(arms, basis)], axis=-1)
    if contact in WITH_TORSION:
        twist = np.concatenate([np.zeros_like(normals_in), normals_in], axis=-1)
        maps = np.concatenate([maps, twist[..., None, :]], axis=-2)
    maps = np.swapaxes(maps, -1, -2)
    if wrench_space == "spatial":
        return maps
    return np.asarray(wrench_projection(wrench_space, plane)[..., None, :, :] @ maps)


def grasp_matrix(maps: FloatArray) -> FloatArray:
    """Return the grasp matrix G, shape (..., d, n_f n_basis), from `wrench_maps`."""
    n_f, size, n_basis = maps.shape[-3:]
    return np.swapaxes(maps, -3, -2).reshape(*maps.shape[:-3], size, n_f * n_basis)


def _force_basis(
    points: FloatArray,
    normals_in: FloatArray,
    centre: FloatArray,
    contact: ContactModel,
    plane_normal: FloatArray | None,
    tangents: FloatArray | None,
) -> FloatArray:
    """Stack each contact's force directions, shape (..., n_f, n_basis, 3)."""
    if contact == "frictionless":
        return normals_in[..., None, :]
    if tangents is None:
        first = contact_tangents(points, normals_in, centre)
        if plane_normal is not None:
            in_plane = cross(plane_normal[..., None, :], normals_in)
            length = np.linalg.norm(in_plane, axis=-1, keepdims=True)
            first = np.where(length > 1e-6, in_plane / np.maximum(length, 1e-300), first)
    else:
        first = tangents if tangents.ndim == points.ndim else tangents[..., 0, :]
    return np.stack([first, cross(normals_in, first), normals_in], axis=-2)


def _plane_through_line(line: FloatArray, normals_in: FloatArray) -> FloatArray:
    """Return the unit normal of the plane through a line that is closest to the contact normals."""
    first = perpendicular(line)
    frame = np.stack([first, cross(line, first)])
    across = normals_in @ frame.T
    values, vectors = np.linalg.eigh(across.T @ across)
    return first if values[1] < 1e-18 else np.asarray(vectors[:, 0] @ frame)
