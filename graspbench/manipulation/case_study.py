"""The case study: two planar grippers carry a bar on which two of the tips slide (thesis 4.5).

Gripper A has the tips 1 and 2, gripper B the tips 3 and 4; each has three arm joints and two branches
of two joints, all links 1 m long. Tips 1 and 3 lie without friction on the bar's top side, tips 2 and
4 hold its bottom side. In arrays, finger 0 is tip 1 and so on; joint 2 is the thesis' joint 3.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation import charts
from graspbench.manipulation.classification import GraspClass, classify
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.forces import is_force_closure
from graspbench.manipulation.kinematic_tree import planar_tree
from graspbench.manipulation.loop import ClikHistory, simulate
from graspbench.manipulation.motion import Segment, Trajectory, arc, line, reverse
from graspbench.manipulation.secondary_task import build_tasks

ARM_JOINT = 2
"""Index of the thesis' joint 3, the last of gripper A's arm."""

Pair = tuple[float, float]


def _tasks() -> dict[str, dict[str, Any]]:
    """The thesis' three secondary tasks, in decreasing priority."""
    return {
        "joint_limit": {
            "priority": 0, "gain": 20.0, "margin": 0.1,
            "joints": (2,), "lower": (-np.pi,), "upper": (np.pi / 2,),
        },
        "fingertip_distance": {
            "priority": 1, "gain": 30.0, "first": 0, "second": 2, "minimum_m": 0.3, "threshold_m": 0.4,
        },
        "contacts_near_point": {
            "priority": 2, "gain": 10.0, "contacts": (0, 2), "middle_of": (1, 3), "reach_m": 0.6,
        },
    }  # fmt: skip


@dataclass(frozen=True)
class CaseStudyParameters:
    """Geometry, path and control of the case study; the thesis gives no bases and no path lengths."""

    bases_m: Annotated[tuple[Pair, Pair], Field(description="Bases of gripper A and B, m")] = (
        (-2.2, -0.6),
        (0.8, -1.7),
    )
    branch_points_m: Annotated[
        tuple[Pair, Pair], Field(description="Where the branches part at the start, m")
    ] = ((-0.4, 0.9), (0.5, -0.4))
    joint_3_start: Annotated[Pair, Field(description="Joint 3 of both arms at the start, rad")] = (1.5, 1.2)
    elbows: Annotated[tuple[int, int], Field(description="Sign of joint 2 less its part of joint 3")] = (
        1,
        -1,
    )
    bends: Annotated[
        tuple[int, int, int, int], Field(description="Sign of the last joint of the branches 1 to 4")
    ] = (1, -1, -1, 1)
    bar_position_m: Annotated[Pair, Field(description="Middle of the bar at the start, m")] = (0.0, 0.0)
    bar_thickness_m: Annotated[float, Field(gt=0, description="Distance of its two sides, m")] = 0.1
    bar_length_m: Annotated[float, Field(gt=0, description="Drawn length of the bar, m")] = 2.0
    line_m: Annotated[Pair, Field(description="From point 1 to point 2 of the path, m")] = (-0.9, -0.4)
    chord_m: Annotated[Pair, Field(description="From point 2 to point 3 of the path, m")] = (-0.9, -0.1)
    arc_deg: Annotated[float, Field(gt=0, lt=360, description="Angle of the arc 2-3")] = 90.0
    segment_s: Annotated[float, Field(gt=0, description="Duration of a segment, s")] = 10.0
    pause_s: Annotated[float, Field(ge=0, description="Pause before each segment, s")] = 1.0
    friction: Annotated[float, Field(ge=0, description="Friction coefficient of tips 2 and 4")] = 0.5
    clik: Annotated[ClikParameters, Field(description="Control; its tasks are the secondary tasks")] = field(
        default_factory=lambda: ClikParameters(integrator="rk4", reference="held", tasks=_tasks())
    )


@dataclass(frozen=True, eq=False)
class CaseStudyResult:
    """One simulation of the case study; arrays have one row a control period.

    Attributes:
        with_tasks: Whether the secondary tasks were on.
        parameters: What was simulated.
        grasp_class: Class of the grasp at the start: counts, redundancy, indeterminacy.
        force_closure: Whether the contacts' forces can balance any load in the plane.
        history: The whole motion.
        desired_positions: Desired position of the bar's middle, shape (t, 3), m.
        pose_error: Norm of the pose error (m, m, rad), mean over the four loops, shape (t,).
        q3: The thesis' joint 3, shape (t,), rad.
        signed_distance_13_m: From tip 1 to tip 3 along the bar, shape (t,).
        contact_x_m: x of the contacts 1 to 4 from the bar's middle, shape (t, 4).
        midpoint_distance_m: Of the tips 1 and 3 from the middle of the tips 2 and 4, shape (t, 2).
        closed_chain_residual_m: Largest disagreement of two fingers on the bar's middle, shape (t,).
        joint_velocities: Shape (t, 14), rad/s.
    """

    with_tasks: bool
    parameters: CaseStudyParameters
    grasp_class: GraspClass
    force_closure: bool
    history: ClikHistory
    desired_positions: FloatArray
    pose_error: FloatArray
    q3: FloatArray
    signed_distance_13_m: FloatArray
    contact_x_m: FloatArray
    midpoint_distance_m: FloatArray
    closed_chain_residual_m: FloatArray
    joint_velocities: FloatArray

    def summary(self) -> dict[str, float | int | bool]:
        """Return the figures that decide, by name."""
        step_s = self.parameters.clik.step_s
        moving = self.history.times >= self.parameters.pause_s
        return {
            "variables": self.grasp_class.variables,
            "closed_chain_constraints": self.grasp_class.closed_chain_constraints,
            "degrees_of_freedom": self.grasp_class.degrees_of_freedom,
            "force_closure": self.force_closure,
            "determinate": not self.grasp_class.indeterminate,
            "redundant": self.grasp_class.redundant,
            "pose_error_max_m": float(self.pose_error.max()),
            "q3_start_rad": float(self.q3[0]),
            "q3_max_rad": float(self.q3.max()),
            "distance_13_min_m": float(self.signed_distance_13_m.min()),
            "midpoint_distance_start_m": float(self.midpoint_distance_m[0].max()),
            "midpoint_distance_max_m": float(self.midpoint_distance_m.max()),
            "midpoint_distance_after_first_pause_max_m": float(self.midpoint_distance_m[moving].max()),
            "closed_chain_residual_max_m": float(self.closed_chain_residual_m.max()),
            "joint_velocity_max_rad_s": float(np.abs(self.joint_velocities).max()),
            "joint_acceleration_max_rad_s2": float(
                np.abs(np.diff(self.joint_velocities, axis=0)).max() / step_s
            ),
        }


def run_case_study(with_tasks: bool, parameters: CaseStudyParameters | None = None) -> CaseStudyResult:
    """Simulate the case study.

    Args:
        with_tasks: Use the secondary tasks of ``parameters.clik.tasks``.
        parameters: Geometry, path and control.
    """
    chosen = parameters or CaseStudyParameters()
    system, joints, contact_variables = case_study_system(chosen)
    trajectory = case_study_path(chosen)
    options: Mapping[str, Mapping[str, Any]] = chosen.clik.tasks if with_tasks else {}
    settings = chosen.clik if with_tasks else replace(chosen.clik, tasks={}, priority_changes=())
    clik = Clik(system, trajectory, settings, build_tasks(options))
    state = system.state(joints, contact_variables)
    grasp_class = classify(state)
    kinds = [contact.kind for contact in system.contacts]
    closure = is_force_closure(state, [chosen.friction if kind == "hard" else 0.0 for kind in kinds])
    history = simulate(clik, joints, contact_variables, trajectory.duration_s)

    along = history.contact_variables[:, :, 1]
    middle = 0.5 * (along[:, 1] + along[:, 3])
    return CaseStudyResult(
        with_tasks=with_tasks,
        parameters=chosen,
        grasp_class=grasp_class,
        force_closure=closure,
        history=history,
        desired_positions=history.desired_positions,
        pose_error=np.linalg.norm(history.pose_errors, axis=2).mean(axis=1),
        q3=history.joints[:, ARM_JOINT],
        signed_distance_13_m=along[:, 2] - along[:, 0],
        contact_x_m=along,
        midpoint_distance_m=np.abs(along[:, [0, 2]] - middle[:, None]),
        closed_chain_residual_m=history.closed_chain_residual_m,
        joint_velocities=history.velocities[:, : system.n_joints],
    )


def case_study_system(
    parameters: CaseStudyParameters,
) -> tuple[ManipulationSystem, FloatArray, FloatArray]:
    """Return the grippers with the bar, and the start: joints (14,) and contact variables (4, 5).

    The start has |1-3| = 0.7 m and |2-4| = 1.2 m with the tips 3 and 4 in line along y, as in the
    thesis; so tip 3 begins 0.6 m from the middle of the tips 2 and 4, and tip 1 0.1 m.
    """
    parents = [-1, 0, 1, 2, 3, 2, 5, -1, 7, 8, 9, 10, 9, 12]
    tree = planar_tree(np.array(parameters.bases_m), parents, [1.0] * 14, [4, 6, 11, 13])
    half = 0.5 * parameters.bar_thickness_m
    up = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # v along x, normal along y
    down = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    top = charts.plane(rotation=up, origin=np.array([0.0, half, 0.0]))
    bottom = charts.plane(rotation=down, origin=np.array([0.0, -half, 0.0]))
    contacts = [
        Contact(top, "frictionless"),
        Contact(bottom, "hard"),
        Contact(top, "frictionless"),
        Contact(bottom, "hard"),
    ]
    bar = np.array([*parameters.bar_position_m, 0.0])
    tips = bar[:2] + np.array([[-0.1, half], [-0.6, -half], [0.6, half], [0.6, -half]])
    joints = []
    for k in range(2):
        base, branch = np.array(parameters.bases_m[k]), np.array(parameters.branch_points_m[k])
        joints += _arm(base, branch, parameters.joint_3_start[k], parameters.elbows[k])
        heading = float(np.sum(joints[-3:]))
        for tip in (2 * k, 2 * k + 1):
            joints += _branch(branch, tips[tip], heading, parameters.bends[tip])
    system = ManipulationSystem(tree, contacts, planar=True)
    system, variables = system.grasped(np.array(joints), bar, np.eye(3))
    return system, np.array(joints), variables


def case_study_path(parameters: CaseStudyParameters) -> Trajectory:
    """Return the path of figure 4.4: line 1-2, arc 2-3, line 3-2, arc 2-3, each after a pause."""
    start = np.array([*parameters.bar_position_m, 0.0])
    second = start + np.array([*parameters.line_m, 0.0])
    chord = np.array([*parameters.chord_m, 0.0])
    angle = np.deg2rad(parameters.arc_deg)
    radius = 0.5 * float(np.linalg.norm(chord)) / np.sin(0.5 * angle)
    across = np.array([chord[1], -chord[0], 0.0]) / np.linalg.norm(chord)
    centre = second + 0.5 * chord + radius * np.cos(0.5 * angle) * across
    out = second - centre
    bow = arc(centre, radius, float(np.arctan2(out[1], out[0])), -angle)
    pieces = [line(start, second), bow, reverse(line(second, second + chord)), bow]
    still = np.zeros(3)
    segments = [Segment(parameters.segment_s, parameters.pause_s, piece, still) for piece in pieces]
    return Trajectory(segments, np.eye(3))


def _arm(base: FloatArray, branch: FloatArray, third: float, elbow_sign: int) -> list[float]:
    """Joints 1 to 3 that bring the branch point into place with a given third joint."""
    reach = branch - base
    distance = float(np.linalg.norm(reach))
    outer = np.array([1.0 + np.cos(third), np.sin(third)])  # links 2 and 3 as one, seen from joint 2
    length, tilt = float(np.linalg.norm(outer)), float(np.arctan2(outer[1], outer[0]))
    cosine = (distance**2 - 1.0 - length**2) / (2.0 * length)
    _reachable(cosine, "arm")
    elbow = elbow_sign * np.arccos(cosine)
    first = np.arctan2(reach[1], reach[0]) - np.arctan2(length * np.sin(elbow), 1.0 + length * np.cos(elbow))
    return [float(first), float(elbow - tilt), third]


def _branch(start: FloatArray, tip: FloatArray, heading: float, bend: int) -> list[float]:
    """Both joints of a branch; ``bend`` is the sign of the last one."""
    reach = tip - start
    cosine = (float(reach @ reach) - 2.0) / 2.0
    _reachable(cosine, "branch")
    second = bend * np.arccos(cosine)
    absolute = np.arctan2(reach[1], reach[0]) - 0.5 * second
    first = (absolute - heading + np.pi) % (2.0 * np.pi) - np.pi
    return [float(first), float(second)]


def _reachable(cosine: float, what: str) -> None:
    if not -1.0 < cosine < 1.0:
        raise ConfigurationError(
            f"the {what} of a gripper cannot reach its start", remedy="move its base or its branch point"
        )
