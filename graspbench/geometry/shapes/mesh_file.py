"""A mesh that comes with pybullet_data."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from graspbench.geometry.body import Body
from graspbench.geometry.files import load_body
from graspbench.geometry.frames import Axis, rotation_to_z
from graspbench.geometry.mesh import moved
from graspbench.geometry.shapes.convex_parts import pybullet_data_path
from graspbench.geometry.shapes.registry import register


@register("pybullet_mesh")
@dataclass(frozen=True)
class PybulletMesh:
    """A closed mesh of pybullet_data."""

    file: Annotated[str, Field(description="Path inside pybullet_data")] = "duck.obj"
    scale: Annotated[float, Field(gt=0, description="Metres per unit of the file")] = 0.05
    up: Annotated[Axis, Field(description="The file's axis that points up")] = "y"

    def build(self) -> Body:
        """Return the mesh in metres."""
        body = load_body(pybullet_data_path() / self.file, self.scale, repair=True)
        return Body(moved(body.mesh, rotation_to_z(self.up)), None, body.repairs, body.warnings)
