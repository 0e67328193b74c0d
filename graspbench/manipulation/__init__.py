"""Manipulation of grasped objects: contact kinematics, CLIK with prioritised tasks, classification.

Names are imported on first use, so that reading the configuration does not load the solvers.
"""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
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
    from graspbench.manipulation.clik import Clik, ClikParameters, PriorityChange
    from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem, State
    from graspbench.manipulation.contact_parameters import ContactParameters
    from graspbench.manipulation.forces import ContactForces, ForceDistribution, ForceParameters
    from graspbench.manipulation.gaiting.gait import gait_object
    from graspbench.manipulation.gaiting.gait_check import GaitCheck, check_gait
    from graspbench.manipulation.gaiting.gait_parameters import GaitParameters
    from graspbench.manipulation.gaiting.gait_result import GaitResult
    from graspbench.manipulation.kinematic_tree import KinematicTree, planar_tree, tree_from_pinocchio
    from graspbench.manipulation.loop import ClikHistory, simulate
    from graspbench.manipulation.manipulate import manipulate_object
    from graspbench.manipulation.manipulation_result import ManipulationResult
    from graspbench.manipulation.motion import MotionParameters, Trajectory, object_motion
    from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue, build_tasks
    from graspbench.manipulation.sliding.sliding_check import SlidingCheck, check_sliding
    from graspbench.manipulation.sliding.sliding_parameters import SlidingParameters

_HOMES = {
    "CaseStudyParameters": "case_study",
    "CaseStudyResult": "case_study",
    "Chart": "charts",
    "Clik": "clik",
    "ClikHistory": "loop",
    "ClikParameters": "clik",
    "Contact": "contact_kinematics",
    "ContactForces": "forces",
    "ContactParameters": "contact_parameters",
    "ForceDistribution": "forces",
    "ForceParameters": "forces",
    "GaitCheck": "gaiting.gait_check",
    "GaitParameters": "gaiting.gait_parameters",
    "GaitResult": "gaiting.gait_result",
    "GraspClass": "classification",
    "KinematicTree": "kinematic_tree",
    "ManipulationResult": "manipulation_result",
    "ManipulationSystem": "contact_kinematics",
    "MotionParameters": "motion",
    "PriorityChange": "clik",
    "SlidingCheck": "sliding.sliding_check",
    "SlidingParameters": "sliding.sliding_parameters",
    "State": "contact_kinematics",
    "TASKS": "secondary_task",
    "SecondaryTask": "secondary_task",
    "TaskValue": "secondary_task",
    "Trajectory": "motion",
    "build_tasks": "secondary_task",
    "check_gait": "gaiting.gait_check",
    "check_sliding": "sliding.sliding_check",
    "classify": "classification",
    "cylinder": "charts",
    "ellipsoid": "charts",
    "gait_object": "gaiting.gait",
    "manipulate_object": "manipulate",
    "mesh_patch": "charts",
    "object_motion": "motion",
    "planar_tree": "kinematic_tree",
    "plane": "charts",
    "revolution": "charts",
    "run_case_study": "case_study",
    "simulate": "loop",
    "sphere": "charts",
    "tree_from_pinocchio": "kinematic_tree",
}

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
    "GaitCheck",
    "GaitParameters",
    "GaitResult",
    "GraspClass",
    "KinematicTree",
    "ManipulationResult",
    "ManipulationSystem",
    "MotionParameters",
    "PriorityChange",
    "SecondaryTask",
    "SlidingCheck",
    "SlidingParameters",
    "State",
    "TaskValue",
    "Trajectory",
    "build_tasks",
    "check_gait",
    "check_sliding",
    "classify",
    "cylinder",
    "ellipsoid",
    "gait_object",
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

__getattr__ = loads_on_use(__name__, _HOMES)
