"""Manipulation of grasped objects: contact kinematics, CLIK with prioritised tasks, classification."""

from graspbench.manipulation.case_study import CaseStudyParameters, CaseStudyResult, run_case_study
from graspbench.manipulation.charts import (
    Chart,
    cylinder,
    ellipsoid,
    mesh_patch,
    plane,
    revolution,
    sphere,
)
from graspbench.manipulation.classification import GraspClass, classify
from graspbench.manipulation.clik import Clik, ClikHistory, ClikParameters, PriorityChange, simulate
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem, State
from graspbench.manipulation.forces import ContactForces, ForceDistribution, ForceParameters
from graspbench.manipulation.manipulate import ContactParameters, ManipulationResult, manipulate_object
from graspbench.manipulation.motion import MotionParameters, Trajectory, object_motion
from graspbench.manipulation.task import TASKS, Task, TaskValue, build_tasks
from graspbench.manipulation.tree import KinematicTree, planar_tree, tree_from_pinocchio

__all__ = [
    "TASKS",
    "CaseStudyParameters",
    "CaseStudyResult",
    "Chart",
    "Clik",
    "ClikHistory",
    "ClikParameters",
    "Contact",
    "ContactForces",
    "ContactParameters",
    "ForceDistribution",
    "ForceParameters",
    "GraspClass",
    "KinematicTree",
    "ManipulationResult",
    "ManipulationSystem",
    "MotionParameters",
    "PriorityChange",
    "State",
    "Task",
    "TaskValue",
    "Trajectory",
    "build_tasks",
    "classify",
    "cylinder",
    "ellipsoid",
    "manipulate_object",
    "mesh_patch",
    "object_motion",
    "planar_tree",
    "plane",
    "revolution",
    "run_case_study",
    "simulate",
    "sphere",
    "tree_from_pinocchio",
]
