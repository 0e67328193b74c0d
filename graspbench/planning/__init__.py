"""Planning of grasps and of the fingertips' paths to them.

The names below load on first use, so that reading the configuration does not load the planners.
"""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use
from graspbench.planning.index import INDICES, Index, Moves, centre_gain, centre_option, make_index
from graspbench.planning.parameters import (
    AnyPlannerParameters,
    BarrierParameters,
    PathParameters,
    PlannerParameters,
    RefineParameters,
    RobustParameters,
)

if TYPE_CHECKING:
    from graspbench.planning.anytime import Plan, plan_with
    from graspbench.planning.approach import clear_approach
    from graspbench.planning.global_search import GlobalResult, plan_global
    from graspbench.planning.grip_plane import GripGeometry, grip_geometry
    from graspbench.planning.local import LocalPlan, plan_local, plan_restarted
    from graspbench.planning.payload import payload_n
    from graspbench.planning.planner import (
        PLANNERS,
        FoundGrasp,
        Planner,
        PlanningProblem,
        make_planner,
        placed_grasp,
    )
    from graspbench.planning.refinement import RefinedGrasp, refine
    from graspbench.planning.search.parameters import SearchParameters
    from graspbench.planning.tracking import JointPath, track
    from graspbench.planning.trajectory import FingertipPath, fingertip_paths

__all__ = [
    "INDICES",
    "PLANNERS",
    "AnyPlannerParameters",
    "BarrierParameters",
    "FingertipPath",
    "FoundGrasp",
    "GlobalResult",
    "GripGeometry",
    "Index",
    "JointPath",
    "LocalPlan",
    "Moves",
    "PathParameters",
    "Plan",
    "Planner",
    "PlannerParameters",
    "PlanningProblem",
    "RefineParameters",
    "RefinedGrasp",
    "RobustParameters",
    "SearchParameters",
    "centre_gain",
    "centre_option",
    "clear_approach",
    "fingertip_paths",
    "grip_geometry",
    "make_index",
    "make_planner",
    "payload_n",
    "placed_grasp",
    "plan_global",
    "plan_local",
    "plan_restarted",
    "plan_with",
    "refine",
    "track",
]

_HOMES = {
    "PLANNERS": "planner",
    "FingertipPath": "trajectory",
    "FoundGrasp": "planner",
    "GlobalResult": "global_search",
    "GripGeometry": "grip_plane",
    "JointPath": "tracking",
    "LocalPlan": "local",
    "Plan": "anytime",
    "Planner": "planner",
    "PlanningProblem": "planner",
    "RefinedGrasp": "refinement",
    "SearchParameters": "search.parameters",
    "clear_approach": "approach",
    "fingertip_paths": "trajectory",
    "grip_geometry": "grip_plane",
    "payload_n": "payload",
    "make_planner": "planner",
    "placed_grasp": "planner",
    "plan_global": "global_search",
    "plan_local": "local",
    "plan_restarted": "local",
    "plan_with": "anytime",
    "refine": "refinement",
    "track": "tracking",
}

__getattr__ = loads_on_use(__name__, _HOMES)
