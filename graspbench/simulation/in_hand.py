"""A planned in-hand motion played in physics: grasp, lift, then the fingers move the object."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.simulation.approach import Approach
from graspbench.simulation.arm_parameters import FLOATING
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.execution_result import Motion, PhaseOutcome
from graspbench.simulation.finger_walk import FingerWalk
from graspbench.simulation.grip import Grip
from graspbench.simulation.in_hand_path import InHandPath
from graspbench.simulation.mounts.choice import Carrier
from graspbench.simulation.phases import plan_lift
from graspbench.simulation.stage import JointPath, Stage, turn_deg
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import World

_SAMPLE_S = 0.02
_SETTLE_S = 0.5


@dataclass(frozen=True)
class InHandResult:
    """What came of an in-hand motion.

    Attributes:
        success: Whether the object was held to the end.
        reason: Why not, one clause; None on success.
        phases: Outcomes of squeeze, lift, hold and the motion, as far as it came.
        friction: Coulomb coefficient between fingertips and object.
        torsional_friction_m: Torque about the contact normal per normal force, m.
        planned_friction: Coulomb coefficient that the grasp was planned with.
        grip_force_n: Mean normal force asked of a finger, 0 if it came to no squeeze.
        times: Since the start of the motion, shape (s,), s; empty if it came to none.
        position_error_m: How far the object's centre is from where the motion wants it, in the palm frame,
            since the motion's start, shape (s,).
        rotation_error_deg: Angle between its orientation and the wanted one, shape (s,).
        moved_m: How far its centre has moved in the palm frame, shape (s,).
        turned_deg: How far it has turned in the palm frame, shape (s,).
        turned_about_axis_deg: How far of that about the path's axis at the end; None without one.
        slips_m: Net sliding of each finger, at the contact where it slid farthest, shape (n,).
        steps: Steps that fingers took.
        steps_missed: Steps that ended without a touch.
        motion: Samples for the record, from the approach on.
    """

    success: bool
    reason: str | None
    phases: tuple[PhaseOutcome, ...]
    friction: float
    torsional_friction_m: float
    planned_friction: float
    grip_force_n: float
    times: FloatArray
    position_error_m: FloatArray
    rotation_error_deg: FloatArray
    moved_m: FloatArray
    turned_deg: FloatArray
    turned_about_axis_deg: float | None
    slips_m: FloatArray
    steps: int
    steps_missed: int
    motion: Motion


def play_in_hand(
    world: World,
    hand: HandModel,
    grasp: Grasp,
    approach_path: JointPath,
    path: InHandPath,
    parameters: ExecutionParameters,
    friction: TipFriction,
    carrier: Carrier = FLOATING,
) -> InHandResult:
    """Grasp and lift the object, then play the joint path under grip force.

    The fingers are springs around the joint path, besides the forces that grip and carry the object. Where
    the path has a finger step, the others hold the object against its weight meanwhile.

    Args:
        world: The object at rest on the table; it is changed.
        hand: The hand.
        grasp: The planned grasp.
        approach_path: The planned motion up to it.
        path: What to do with the object.
        parameters: How to execute.
        friction: Between fingertips and object.
        carrier: What carries the hand.

    Raises:
        SimulationError: The simulation diverged, or the arm can do what is asked from no place.
        HandError: PyBullet cannot load the hand.
    """
    stage = Stage(world, hand, approach_path, parameters, friction, plan_lift, carrier=carrier)
    fingers = grasp.posture.fingers if grasp.posture is not None else tuple(range(len(grasp.points)))
    approach = Approach(stage, grasp, fingers)
    approach.follow(approach_path)
    approach.close()
    missing = [f for f in fingers if f not in approach.touch]
    if missing:
        names = ", ".join(hand.finger_names[f] for f in missing)
        return _result(stage, None, None, path, [], f"no touch of {names} at the end of the approach")
    grip = Grip(stage, fingers, [approach.touch[f] for f in fingers])
    tracked: list[tuple[float, FloatArray, FloatArray]] = []
    walk = None
    if grip.squeeze() and all(grip.move(phase) for phase in stage.phases().carrying):
        walk = FingerWalk(stage, grip, fingers, path)
        tracked = _move_in_hand(stage, grip, path, walk)
    return _result(stage, grip, walk, path, tracked, grip.reason)


def _move_in_hand(
    stage: Stage, grip: Grip, path: InHandPath, walk: FingerWalk
) -> list[tuple[float, FloatArray, FloatArray]]:
    """Play the path; return time, real and wanted pose of the object in the palm at every sample."""
    dt = stage.time_step_s
    steps = max(1, round(walk.duration_s / dt))
    every = max(1, round(_SAMPLE_S / dt))
    start = grip.object_in_palm()
    tracked = [(0.0, start, start)]

    def drive(k: int) -> str | None:
        time_s = walk.at(min(k * dt, walk.duration_s))
        wanted = path.moved_at(time_s) @ start
        grip.control.aim(walk.rest(path.joints_at(time_s), time_s), wanted)
        if k % every == 0:
            grip.control.distribute()  # contacts roll over the surface
            if k > 0:
                tracked.append((k * dt, grip.object_in_palm(), wanted))
                off_m = np.linalg.norm(tracked[-1][1][:3, 3] - wanted[:3, 3])
                if off_m > stage.parameters.slip_limit_m:
                    return f"the object slipped {1e3 * off_m:.0f} mm"
        return walk.lost

    goal = path.moved_at(float(path.times[-1])) @ start
    grip.play("in_hand", drive, steps + round(_SETTLE_S / dt), goal)
    return tracked


def _result(
    stage: Stage,
    grip: Grip | None,
    walk: FingerWalk | None,
    path: InHandPath,
    tracked: list[tuple[float, FloatArray, FloatArray]],
    reason: str | None,
) -> InHandResult:
    stage.sample()
    start = tracked[0][1] if tracked else np.eye(4)
    return InHandResult(
        success=reason is None,
        reason=reason,
        phases=() if grip is None else tuple(grip.phases),
        friction=stage.friction.coulomb,
        torsional_friction_m=stage.friction.torsional_m,
        planned_friction=stage.friction.planned,
        grip_force_n=0.0 if grip is None else grip.control.mean_force_n,
        times=np.array([time for time, _, _ in tracked]),
        position_error_m=np.array([np.linalg.norm(real[:3, 3] - goal[:3, 3]) for _, real, goal in tracked]),
        rotation_error_deg=np.array([turn_deg(goal, real) for _, real, goal in tracked]),
        moved_m=np.array([np.linalg.norm(real[:3, 3] - start[:3, 3]) for _, real, _ in tracked]),
        turned_deg=np.array([turn_deg(start, real) for _, real, _ in tracked]),
        turned_about_axis_deg=None if path.axis is None or not tracked else _turned_about(path.axis, tracked),
        slips_m=np.zeros(0) if grip is None else grip.slips_m,
        steps=0 if walk is None else len(path.steps),
        steps_missed=0 if walk is None else walk.missed,
        motion=stage.motion(),
    )


def _turned_about(axis: FloatArray, tracked: list[tuple[float, FloatArray, FloatArray]]) -> float:
    """Return how far the object has turned about an axis in the end, in deg; whole turns are counted."""
    start = tracked[0][1][:3, :3]
    turns = Rotation.from_matrix([real[:3, :3] @ start.T for _, real, _ in tracked]).as_quat()
    angles = np.unwrap(2.0 * np.arctan2(turns[:, :3] @ axis, turns[:, 3]), period=2.0 * np.pi)
    return float(np.degrees(angles[-1] - angles[0]))
