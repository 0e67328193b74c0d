"""Bodies given as overlapping convex parts in pybullet_data: the teddy bear and the random objects."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.errors import MeshError
from graspbench.geometry.body import Body
from graspbench.geometry.convex_union import read_obj_parts, unite_convex_parts
from graspbench.geometry.frames import Axis, rotation_to_z
from graspbench.geometry.shapes.registry import register

RANDOM_OBJECTS = 1000

_Growth = Annotated[float, Field(ge=0)]
_GROWTH = "Growth of each part, m, so that they join; further values are tried when they do not"


def pybullet_data_path() -> Path:
    """Return the folder of the data that comes with PyBullet.

    Raises:
        MeshError: PyBullet is not installed.
    """
    spec = find_spec("pybullet_data")
    if spec is None or spec.origin is None:
        raise MeshError("the object needs pybullet_data, which is not installed", remedy="install pybullet")
    return Path(spec.origin).parent


@register("pybullet_parts")
@dataclass(frozen=True)
class PybulletParts:
    """The union of the convex parts of a Wavefront file of pybullet_data."""

    file: Annotated[str, Field(description="Path inside pybullet_data")] = "teddy2_VHACD_CHs.obj"
    scale: Annotated[float, Field(gt=0, description="Metres per unit of the file")] = 0.1
    up: Annotated[Axis, Field(description="The file's axis that points up")] = "y"
    inflate_m: Annotated[tuple[_Growth, ...], Field(min_length=1, description=_GROWTH)] = (2e-4,)

    def build(self) -> Body:
        """Return the union of the parts."""
        path = pybullet_data_path() / self.file
        turn = self.scale * rotation_to_z(self.up)
        parts = [points @ turn.T for points in read_obj_parts(path)]
        return unite_convex_parts(parts, self.inflate_m, Path(self.file).stem)


@register("random_urdf")
@dataclass(frozen=True)
class RandomUrdf:
    """One of the 1000 random grasp objects of pybullet_data."""

    id: Annotated[int, Field(ge=0, lt=RANDOM_OBJECTS, description="Which one, 0 to 999")] = 0
    scale: Annotated[float, Field(gt=0, description="Metres per unit of the file, as its URDF says")] = 0.015
    inflate_m: Annotated[tuple[_Growth, ...], Field(min_length=1, description=_GROWTH)] = (2e-4, 5e-4, 1e-3)

    def build(self) -> Body:
        """Return the union of the parts."""
        name = f"{self.id:03d}"
        path = pybullet_data_path() / "random_urdfs" / name / f"{name}.obj"
        parts = [np.asarray(points) * self.scale for points in read_obj_parts(path)]
        return unite_convex_parts(parts, self.inflate_m, f"random object {name}")
