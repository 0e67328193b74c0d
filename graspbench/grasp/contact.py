"""Contact models: frames, and the forces that a contact can transmit."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError

ContactModel: TypeAlias = Literal["frictionless", "hard_finger", "soft_finger", "soft_pad"]

CONTACT_MODELS: tuple[ContactModel, ...] = ("frictionless", "hard_finger", "soft_finger", "soft_pad")

WITH_TORSION: tuple[ContactModel, ...] = ("soft_finger", "soft_pad")
"""Contacts that transmit a moment about their normal."""


@dataclass(frozen=True, eq=False)
class ContactPolytope:
    """The forces of unit normal component that a contact can transmit, linearised.

    Coordinates are those of the contact basis: [normal] for a frictionless point, [tangent 1,
    tangent 2, normal] for a hard finger, and a moment about the normal after them for a soft finger or pad.

    Attributes:
        vertices: Corners of the polytope, shape (n_vertices, n_basis).
        faces: ``faces[k]`` holds k + 1 corners that span each face of dimension k,
            shape (n_faces, k + 1); from the corners up to the polytope itself.
    """

    vertices: FloatArray
    faces: tuple[IntArray, ...]


@lru_cache(maxsize=64)
def contact_polytope(
    contact: ContactModel, friction: float = 0.5, cone_edges: int = 8, torsional_friction: float = 0.05
) -> ContactPolytope:
    """Return the linearised unit friction cone of a contact model.

    A hard finger's circular cone is replaced by the inscribed pyramid with ``cone_edges`` edges, the
    first one along tangent 1. A soft finger may add any moment about the normal up to
    ``torsional_friction`` (Murray, Li and Sastry 1994, section 5.2): a prism over the same polygon. A soft
    pad has to share its friction between force and moment: a polyhedron inside the ellipsoid over the
    same polygon, with corners as far apart towards the moment as they are along the polygon.

    Args:
        contact: Contact model.
        friction: Friction coefficient.
        cone_edges: Edges of the pyramid, at least 3.
        torsional_friction: Largest moment about the normal per unit normal force, in torque lengths.

    Raises:
        ConfigurationError: An argument is out of its range.
    """
    _check(contact, friction, cone_edges, torsional_friction)
    if contact == "frictionless":
        return ContactPolytope(np.ones((1, 1)), (np.zeros((1, 1), dtype=np.int64),))
    m = cone_edges
    angles = 2.0 * np.pi * np.arange(m) / m
    polygon = np.column_stack([friction * np.cos(angles), friction * np.sin(angles), np.ones(m)])
    corner = np.arange(m)
    edges = np.column_stack([corner, (corner + 1) % m])
    flat = np.array([[0, m // 3, (2 * m) // 3]])
    if contact == "hard_finger":
        return ContactPolytope(polygon, (corner[:, None], edges, flat))
    if contact == "soft_pad":
        return _ellipsoid(polygon, torsional_friction)
    vertices = np.vstack(
        [np.column_stack([polygon, np.full(m, sign * torsional_friction)]) for sign in (-1.0, 1.0)]
    )
    uprights = np.column_stack([corner, corner + m])
    sides = np.column_stack([edges, corner + m])
    return ContactPolytope(
        vertices,
        (
            np.arange(2 * m)[:, None],
            np.vstack([edges, edges + m, uprights]),
            np.vstack([flat, flat + m, sides]),
            np.column_stack([flat, [m]]),
        ),
    )


def _ellipsoid(polygon: FloatArray, torsional_friction: float) -> ContactPolytope:
    """Return the polyhedron inside the ellipsoid over a friction polygon: rings of corners and two poles."""
    m = len(polygon)
    levels = max(1, round(m / 4))  # from the polygon to a pole
    latitudes = 0.5 * np.pi * np.arange(1 - levels, levels) / levels
    rings = [
        np.column_stack([np.cos(a) * polygon[:, :2], np.ones(m), np.full(m, np.sin(a) * torsional_friction)])
        for a in latitudes
    ]
    poles = np.array([[0.0, 0.0, 1.0, sign * torsional_friction] for sign in (-1.0, 1.0)])
    count, corner = m * len(rings), np.arange(m)
    ring = np.column_stack([corner, (corner + 1) % m])
    upper = m * (len(rings) - 1)
    edges = [ring + m * k for k in range(len(rings))]
    edges += [np.column_stack([corner, corner + m]) + m * k for k in range(len(rings) - 1)]
    edges += [
        np.column_stack([corner, np.full(m, count)]),
        np.column_stack([corner + upper, np.full(m, count + 1)]),
    ]
    sides = [np.column_stack([ring, corner + m]) + m * k for k in range(len(rings) - 1)]
    sides += [np.column_stack([ring, np.full(m, count)])]
    sides += [np.column_stack([ring + upper, np.full(m, count + 1)])]
    body = np.array([[0, m // 3, (2 * m) // 3, count]])
    return ContactPolytope(
        np.vstack([*rings, poles]),
        (np.arange(count + 2)[:, None], np.vstack(edges), np.vstack(sides), body),
    )


def contact_tangents(points: FloatArray, normals_in: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the first tangent of each contact by the package's fixed rule.

    Tangent 1 is the part of the vector from the contact to the centre that is perpendicular to the
    normal, so that it turns with the grasp. Where the normal itself points to the centre, it is the
    same part of the coordinate axis that is furthest from the normal.

    Args:
        points: Contact points, shape (..., 3).
        normals_in: Unit normals pointing into the object, shape (..., 3).
        centre: Centre of the object, shape (3,).

    Returns:
        Unit tangents, shape (..., 3).
    """
    to_centre = centre - points
    tangent = _reject(to_centre, normals_in)
    length = np.linalg.norm(tangent, axis=-1)
    undefined = length <= 1e-6 * np.linalg.norm(to_centre, axis=-1)
    if np.any(undefined):
        tangent[undefined] = perpendicular(normals_in[undefined])
        length = np.linalg.norm(tangent, axis=-1)
    return np.asarray(tangent / length[..., None])


def perpendicular(directions: FloatArray) -> FloatArray:
    """Return a unit vector perpendicular to each direction, nearest its weakest coordinate axis."""
    axis = np.eye(3)[np.argmin(np.abs(directions), axis=-1)]
    vector = _reject(axis, directions)
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))


def _reject(vectors: FloatArray, units: FloatArray) -> FloatArray:
    """Remove from each vector its component along the unit vector."""
    return np.asarray(vectors - np.sum(vectors * units, axis=-1, keepdims=True) * units)


def _check(contact: str, friction: float, cone_edges: int, torsional_friction: float) -> None:
    if contact not in CONTACT_MODELS:
        raise ConfigurationError(
            f"unknown contact model '{contact}'", remedy=f"choose one of {', '.join(CONTACT_MODELS)}"
        )
    if contact == "frictionless":
        return
    if not friction > 0.0:
        raise ConfigurationError(
            f"the friction coefficient of a {contact} contact is {friction}",
            remedy="give a positive one, or choose the frictionless contact",
        )
    if cone_edges < 3:
        raise ConfigurationError(f"a friction cone with {cone_edges} edges", remedy="give at least 3")
    if contact in WITH_TORSION and not torsional_friction > 0.0:
        raise ConfigurationError(
            f"the torsional friction of a {contact} contact is {torsional_friction}",
            remedy="give a positive one, or choose the hard finger",
        )
