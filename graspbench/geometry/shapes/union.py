"""Several shapes joined into one body."""

import math
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field

from graspbench.errors import MeshError
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import from_manifold, to_manifold
from graspbench.geometry.decomposition import convex_parts
from graspbench.geometry.frames import Axis, rotation_to_z
from graspbench.geometry.mesh import moved
from graspbench.geometry.shapes.registry import make_shape, register


@dataclass(frozen=True)
class Placed:
    """One shape and where it is."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    shape: Annotated[dict[str, Any], Field(description="kind and parameters of the shape")] = field(
        default_factory=dict
    )
    at_m: Annotated[tuple[float, float, float], Field(description="Where its origin goes, m")] = (
        0.0,
        0.0,
        0.0,
    )
    up: Annotated[Axis, Field(description="Its axis that is turned up, before the yaw")] = "z"
    yaw_deg: Annotated[float, Field(description="Turn about the vertical, deg")] = 0.0

    def build(self) -> Body:
        """Return the shape where it is placed."""
        body = make_shape(self.shape).build()
        c, s = math.cos(math.radians(self.yaw_deg)), math.sin(math.radians(self.yaw_deg))
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation_to_z(self.up)
        offset = np.array(self.at_m)
        parts = body.parts or convex_parts(body.mesh)
        return Body(moved(body.mesh, turn, offset), tuple(moved(part, turn, offset) for part in parts))


@register("union")
@dataclass(frozen=True)
class Union:
    """Overlapping shapes joined into one body of genus 0."""

    members: Annotated[tuple[Placed, ...], Field(min_length=2, description="The shapes and their places")]

    def build(self) -> Body:
        """Return the union of the members."""
        import manifold3d

        bodies = [member.build() for member in self.members]
        solids = [to_manifold(body.mesh.vertices, body.mesh.faces) for body in bodies]
        union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
        if (count := len(union.decompose())) != 1:
            raise MeshError(
                f"the members of shape 'union' form {count} surfaces instead of one",
                remedy="place them so that they overlap without enclosing a cavity",
            )
        return Body(from_manifold(union), tuple(part for body in bodies for part in body.parts or ()))
