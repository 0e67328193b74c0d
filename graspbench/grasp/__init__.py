"""Grasps: contact models, wrenches, force closure and quality measures."""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
    from graspbench.grasp.closure import force_closure, is_force_closure
    from graspbench.grasp.configuration import Grasp
    from graspbench.grasp.quality import GraspQuality, QualityParameters, grasp_quality

__all__ = [
    "Grasp",
    "GraspQuality",
    "QualityParameters",
    "force_closure",
    "grasp_quality",
    "is_force_closure",
]

_HOMES = {
    "Grasp": "configuration",
    "GraspQuality": "quality",
    "QualityParameters": "quality",
    "force_closure": "closure",
    "grasp_quality": "quality",
    "is_force_closure": "closure",
}

__getattr__ = loads_on_use(__name__, _HOMES)
