"""The object of a trial."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from graspbench.arrays import FloatArray
from graspbench.geometry.mesh import mass_properties

if TYPE_CHECKING:
    import trimesh

    from graspbench.geometry.inspection import MeshReport


@dataclass(frozen=True)
class ObjectModel:
    """A rigid object; its frame has its origin at the centre of mass and z along the natural up axis.

    Attributes:
        name: What the object is called.
        mesh: One closed surface with outward normals, m, object frame.
        collision_parts: Convex pieces whose union is the object, m, object frame.
        mass_kg: Mass, evenly spread over the volume.
        friction: Coulomb coefficient of its surface.
        rgba: Colour, each 0 to 1.
        yaw_deg: Turn about the vertical before the object is put down.
        licence: Licence of the shape.
        source: Where the shape comes from.
        report: What the preflight said about it; None for an object made by hand.
        transform_file_to_object: Where the frame of the mesh file (its coordinates in m) or of the shape's
            description is in the object's frame, shape (4, 4); None: they are the same.
    """

    name: str
    mesh: trimesh.Trimesh
    collision_parts: tuple[trimesh.Trimesh, ...]
    mass_kg: float
    friction: float = 0.5
    rgba: tuple[float, float, float, float] = (0.85, 0.45, 0.15, 1.0)
    yaw_deg: float = 0.0
    licence: str = ""
    source: str = ""
    report: MeshReport | None = None
    transform_file_to_object: FloatArray | None = None

    @cached_property
    def inertia(self) -> FloatArray:
        """Inertia about the centre of mass in the object frame, shape (3, 3), kg m^2."""
        volume, _, inertia = mass_properties(self.mesh.vertices, self.mesh.faces)
        return inertia * (self.mass_kg / volume)

    @property
    def extents_m(self) -> FloatArray:
        """Size of the bounding box in the object frame, shape (3,)."""
        extents: FloatArray = self.mesh.bounds[1] - self.mesh.bounds[0]
        return extents
