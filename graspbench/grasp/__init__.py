"""Grasps: contact models, wrenches, force closure and quality measures."""

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
