"""The classical quality measures Q1, Q2 and Q3 of a grasp (thesis 3.6)."""

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.grasp.contact import ContactModel, ContactPolytope, contact_polytope
from graspbench.grasp.epsilon import CLOSURE_TOLERANCE, smallest_support
from graspbench.grasp.soft_pad import PadParameters
from graspbench.grasp.wrench import WrenchSpace, auto_torque_length, grasp_matrix, wrench_maps

Norm: TypeAlias = Literal["l1", "linf"]

THESIS_MEASURES = ("q1", "q2", "q3")
"""The fields of `GraspQuality`, in the order of thesis table 3.1."""


_CONTACT_WORDS = {
    "frictionless": "frictionless points",
    "hard_finger": "hard fingers",
    "soft_finger": "soft fingers",
    "soft_pad": "soft pads",
}
_SPACE_WORDS = {
    "spatial": "forces and moments in space",
    "spatial_force": "forces in space, moments neglected",
    "planar": "forces in the grasp's plane and the moment about its normal",
    "planar_force": "forces in the grasp's plane, moments and transversal forces neglected",
}


@dataclass(frozen=True)
class QualityParameters:
    """How contacts and wrenches are modelled when a grasp is scored."""

    contact: Annotated[ContactModel, Field(description="Contact model")] = "hard_finger"
    wrench_space: Annotated[WrenchSpace, Field(description="Wrenches that the grasp should resist")] = (
        "spatial"
    )
    friction: Annotated[float, Field(gt=0, description="Friction coefficient")] = 0.5
    cone_edges: Annotated[int, Field(ge=3, le=64, description="Edges of the linearised friction cone")] = 8
    torsional_friction: Annotated[
        float, Field(gt=0, description="Soft finger: moment about the normal per unit force, torque lengths")
    ] = 0.05
    pad: Annotated[PadParameters, Field(description="Soft pad: its contact patch")] = field(
        default_factory=PadParameters
    )
    torque_length: Annotated[
        Literal["auto"] | float,
        Field(description="Torques are divided by it, m; auto: largest centroid-to-surface distance"),
    ] = "auto"
    norm: Annotated[
        Norm, Field(description="Q3 bounds the sum of the finger forces (l1) or each of them (linf)")
    ] = "l1"
    task_moment: Annotated[
        float, Field(gt=0, description="Task ellipsoid: moments to resist per unit force, torque lengths")
    ] = 0.5
    measures: Annotated[
        tuple[str, ...],
        Field(description="Further measures to report of each grasp; see graspbench measures list"),
    ] = ()

    def __post_init__(self) -> None:
        if self.torque_length != "auto" and not self.torque_length > 0.0:
            raise ConfigurationError(
                f"quality.torque_length is {self.torque_length}", remedy="give a positive one"
            )

    def describe(self) -> str:
        """Say in one clause what Q1 to Q3 are of: contact, friction, space, torque length, norm."""
        contact = _CONTACT_WORDS[self.contact]
        if self.contact != "frictionless":
            contact += f" (friction {self.friction:g}, {self.cone_edges} cone edges"
            if self.contact == "soft_finger":
                contact += f", torsional friction {self.torsional_friction:g} torque lengths"
            if self.contact == "soft_pad":
                radius_mm = 1e3 * self.pad.patch_radius_m(self.pad.load_n)
                contact += f", patch of {radius_mm:.2g} mm radius under {self.pad.load_n:g} N"
            contact += ")"
        words = [contact, _SPACE_WORDS[self.wrench_space]]
        if not self.wrench_space.endswith("_force"):
            length = (
                "the largest distance of the surface from its centroid"
                if self.torque_length == "auto"
                else f"{1e3 * self.torque_length:g} mm"
            )
            words.append(f"moments over {length}")
        words.append(
            "Q3 for a bounded sum of finger forces" if self.norm == "l1" else "Q3 for bounded finger forces"
        )
        return ", ".join(words)

    def torsion(self, torque_length_m: float) -> float:
        """Return the largest moment about a contact's normal per unit force, in torque lengths."""
        if self.contact == "soft_pad":
            return self.pad.torsion_m(self.pad.load_n, self.friction) / torque_length_m
        return self.torsional_friction

    def polytope(self, torque_length_m: float) -> ContactPolytope:
        """Return the linearised unit friction cone, moments in torque lengths."""
        return contact_polytope(self.contact, self.friction, self.cone_edges, self.torsion(torque_length_m))

    def torque_length_m(self, surface_points: FloatArray, centre: FloatArray) -> float:
        """Return the torque length on a surface with points of shape (n_s, 3), m."""
        if self.torque_length == "auto":
            return auto_torque_length(surface_points, centre)
        return float(self.torque_length)


class GraspQuality(NamedTuple):
    """The three measures of the thesis; floats for one grasp, arrays of shape (n,) for a batch.

    Attributes:
        q1: Smallest singular value of the grasp matrix (Li and Sastry 1988).
        q2: Product of the grasp matrix's singular values: volume of the image of the unit ball of
            contact forces, without the constant factor (Li and Sastry 1988).
        q3: Radius of the largest origin-centred ball in the grasp wrench space (Ferrari and Canny
            1992); 0 for a grasp that is not force closure.
    """

    q1: Any
    q2: Any
    q3: Any


def grasp_quality(
    points: FloatArray,
    normals_in: FloatArray,
    centre: FloatArray,
    *,
    contact: ContactModel = "hard_finger",
    wrench_space: WrenchSpace = "spatial",
    friction: float = 0.5,
    cone_edges: int = 8,
    torque_length: float = 1.0,
    tangents: FloatArray | None = None,
    torsional_friction: float = 0.05,
    norm: Norm = "l1",
) -> GraspQuality:
    """Score one grasp or a batch of grasps by Q1, Q2 and Q3.

    Args:
        points: Contact points, shape (n_f, 3) or (n, n_f, 3), m.
        normals_in: Normals pointing INTO the object, same shape; they need not be of unit length.
        centre: Centre of the moments (the object's centroid), shape (3,), m.
        contact: ``frictionless``, ``hard_finger``, ``soft_finger`` or ``soft_pad``.
        wrench_space: ``spatial``, ``planar``, ``spatial_force`` or ``planar_force``.
        friction: Friction coefficient.
        cone_edges: Edges of the linearised friction cone; only Q3 depends on it.
        torque_length: Moments are divided by it, m.
        tangents: First tangent of each contact, shape of ``points``: the direction of the cone's first
            edge. By default the fixed rule of `graspbench.grasp.contact.contact_tangents`.
        torsional_friction: Soft finger and soft pad only: largest moment about the normal per unit normal
            force, in torque lengths.
        norm: Q3's wrench space: ``l1`` bounds the sum of the normal forces by one, ``linf`` each of them.

    Raises:
        ConfigurationError: An argument is unknown, out of range or of the wrong shape.
    """
    points, normals_in = unit_batch(points, normals_in)
    maps = wrench_maps(
        points,
        normals_in,
        np.asarray(centre, dtype=np.float64),
        contact=contact,
        wrench_space=wrench_space,
        torque_length=torque_length,
        tangents=None if tangents is None else np.asarray(tangents, dtype=np.float64),
    )
    polytope = contact_polytope(contact, friction, cone_edges, torsional_friction)
    q1, q2 = singular_measures(grasp_matrix(maps))
    q3 = ball_radius(maps, polytope, norm=norm)
    if points.ndim == 2:
        return GraspQuality(float(q1), float(q2), float(q3))
    return GraspQuality(q1, q2, q3)


def singular_measures(grasp_matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return Q1 and Q2 of grasp matrices, shape (..., d, n_columns)."""
    size, columns = grasp_matrices.shape[-2:]
    values = np.asarray(np.linalg.svd(grasp_matrices, compute_uv=False), dtype=np.float64)
    if columns < size:
        return np.zeros(values.shape[:-1]), np.zeros(values.shape[:-1])
    return values[..., -1], np.asarray(np.prod(values, axis=-1))


def ball_radius(maps: FloatArray, polytope: ContactPolytope, *, norm: Norm = "l1") -> FloatArray:
    """Return Q3 for the contacts' wrench maps, shape (..., n_f, d, n_basis)."""
    wrenches = polytope.vertices @ np.swapaxes(maps, -1, -2)
    stacked = wrenches.reshape(-1, *wrenches.shape[-3:])
    values = smallest_support(stacked, polytope, minkowski=norm == "linf", stop_at=CLOSURE_TOLERANCE)
    return np.where(values > CLOSURE_TOLERANCE, values, 0.0).reshape(maps.shape[:-3])


def unit_batch(points: FloatArray, normals_in: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Check the shapes of one grasp or a batch, and make the normals unit."""
    points = np.asarray(points, dtype=np.float64)
    normals_in = np.asarray(normals_in, dtype=np.float64)
    if points.ndim not in (2, 3) or points.shape[-1] != 3 or points.shape != normals_in.shape:
        raise ConfigurationError(
            f"contact points of shape {points.shape} with normals of shape {normals_in.shape}",
            remedy="give both as (n_f, 3) or (n, n_f, 3)",
        )
    length = np.linalg.norm(normals_in, axis=-1, keepdims=True)
    if not np.all(length > 0.0) or not np.all(np.isfinite(points)):
        raise ConfigurationError("a contact has no normal or no finite position")
    return points, normals_in / length
