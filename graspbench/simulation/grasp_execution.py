"""A planned grasp executed in the physics simulation: approach, squeeze, lift, tilt, pushes and shakes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.hand.touching import touching
from graspbench.simulation.approach import Approach
from graspbench.simulation.arm_parameters import FLOATING
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.execution_result import ExecutionResult, PhaseOutcome, StepOutcome
from graspbench.simulation.exploration import Exploration, Explorer, FeltParts
from graspbench.simulation.grip import Grip
from graspbench.simulation.mounts.choice import Carrier
from graspbench.simulation.ride import Ride
from graspbench.simulation.stage import JointPath, Stage, turn_deg
from graspbench.simulation.step_response import step_outcomes
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.touch import Touch
from graspbench.simulation.world import World

_PUSHES = np.vstack((np.eye(3), -np.eye(3)))[[0, 3, 1, 4, 2, 5]]


def execute_grasp(
    world: World,
    hand: HandModel,
    grasp: Grasp,
    path: JointPath,
    parameters: ExecutionParameters,
    friction: TipFriction,
    ride: Ride | None = None,
    felt: FeltParts | None = None,
    carrier: Carrier = FLOATING,
) -> ExecutionResult:
    """Execute a planned grasp on the object in the world.

    The hand follows the path by position control. A finger that touches stops; after the path's end
    the others go on along the contact's normal. With ``until`` beyond "contact" the fingers then squeeze,
    lift and so on (`graspbench.simulation.grip`).

    Args:
        world: The object at rest on the table; it is changed by the execution.
        hand: The hand.
        grasp: The planned grasp; its posture tells which finger goes to which contact.
        path: The planned motion.
        parameters: How to execute.
        friction: Between fingertips and object.
        ride: How the object moves, as far as the hand knows; None for one at rest.
        felt: What exploring touches need, if any are to be made.
        carrier: What carries the hand.

    Raises:
        SimulationError: The simulation diverged, or the arm can do what is asked from no place.
        HandError: PyBullet cannot load the hand.
    """
    if grasp.posture is not None:
        hand = touching(hand, grasp.posture, grasp.normals)
    stage = Stage(world, hand, path, parameters, friction, ride=ride, carrier=carrier)
    start = stage.object_pose()
    fingers = grasp.posture.fingers if grasp.posture is not None else tuple(range(len(grasp.points)))
    approach = Approach(stage, grasp, fingers)
    explored = None
    if felt is not None and parameters.touch.max_touches > 0:
        tip_error, explored = _explore(stage, approach, path, grasp, fingers, felt)
        grasp = explored.grasp
    else:
        tip_error = approach.follow(path)
    approach.close()
    reached = stage.object_pose()
    contacts = _felt_contacts(world, approach, fingers)
    displacement = float(np.linalg.norm(reached[:3, 3] - start[:3, 3]))
    made = sum(np.isfinite(approach.contact_time_s[f]) for f in fingers)
    reason = None if made == len(fingers) else f"only {made} of {len(fingers)} fingers touched the object"
    outcome = None
    if reason is None and stage.phases().carrying:
        outcome = _hold_and_disturb(stage, fingers, [approach.touch[f] for f in fingers])
        reason = outcome.reason
    stage.sample()
    return ExecutionResult(
        success=reason is None,
        reason=reason,
        fingers=len(fingers),
        contacts_made=int(made),
        contact_time_s=tuple(float(approach.contact_time_s[f]) for f in fingers),
        contact_error_m=tuple(
            float(np.linalg.norm(approach.place[f] - point)) if f in approach.place else np.nan
            for f, point in zip(fingers, grasp.points, strict=True)
        ),
        tip_error_max_m=tip_error,
        palm_error_max_m=stage.palm_error_max_m,
        object_displacement_m=displacement,
        object_turn_deg=turn_deg(start, reached),
        friction=friction.coulomb,
        torsional_friction_m=friction.torsional_m,
        planned_friction=friction.planned,
        grip_force_n=0.0 if outcome is None else outcome.grip_force_n,
        phases=() if outcome is None else outcome.phases,
        pushes_weight=None if outcome is None else outcome.pushes_weight,
        twists_nm=None if outcome is None else outcome.twists_nm,
        steps={} if outcome is None else outcome.steps,
        time_s=stage.time_s,
        motion=stage.motion(),
        explored=explored,
        contacts=contacts,
    )


def _felt_contacts(world: World, approach: Approach, fingers: tuple[int, ...]) -> FloatArray | None:
    """Return where the fingers touch and the inward normals there, in the object's frame, (n, 2, 3)."""
    if any(f not in approach.touch for f in fingers):
        return None
    to_world = world.object_pose()
    points = np.stack([approach.touch[f].point for f in fingers]) - to_world[:3, 3]
    normals = np.stack([approach.touch[f].normal for f in fingers])
    return np.stack((points @ to_world[:3, :3], normals @ to_world[:3, :3]), axis=1)


@dataclass(frozen=True)
class _PartOfPath:
    times: FloatArray
    joints: FloatArray
    transform_palm_to_world: FloatArray


def _explore(
    stage: Stage, approach: Approach, path: JointPath, grasp: Grasp, fingers: tuple[int, ...], felt: FeltParts
) -> tuple[float, Exploration]:
    """Go to where the hand floats over the object, feel it, and close where it was found."""
    k = felt.closing
    there = _PartOfPath(path.times[: k + 1], path.joints[: k + 1], path.transform_palm_to_world[: k + 1])
    error = approach.follow(there, arriving=False)
    explorer = Explorer(
        stage, grasp, fingers, felt.surface, path.joints[k], path.transform_palm_to_world[k],
        stage.parameters.touch,
    )  # fmt: skip
    explored = explorer.explore()
    stage.correct(explored.belief.transform)
    rest = _PartOfPath(path.times[k:] - path.times[k], path.joints[k:], path.transform_palm_to_world[k:])
    approach.use(explored.grasp)
    return max(error, approach.follow(rest)), explored


@dataclass(frozen=True)
class _HoldOutcome:
    """What came of the phases after the contact.

    Attributes:
        grip_force_n: Mean normal force of a finger.
        phases: Their outcomes, up to the first that lost the object.
        pushes_weight: Largest push resisted along +-x, +-y, +-z, multiples of the weight; None if not tried.
        twists_nm: Largest torque resisted about the same axes; None if not tried.
        reason: Why the object was lost; None if it was not.
        steps: Answers to the steps that were tried, by kind.
    """

    grip_force_n: float
    phases: tuple[PhaseOutcome, ...]
    pushes_weight: tuple[float, ...] | None
    twists_nm: tuple[float, ...] | None
    reason: str | None
    steps: dict[str, StepOutcome]


def _hold_and_disturb(stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> _HoldOutcome:
    """Squeeze, lift, hold, tilt and hold again; then push and shake, as far as it is asked for.

    Args:
        stage: Hand and object, all fingers in touch.
        fingers: The fingers that touch.
        touches: How each of them touched first.
    """
    grip = Grip(stage, fingers, touches)
    pushes = twists = None
    steps: dict[str, StepOutcome] = {}
    if grip.squeeze():
        plan = stage.phases()
        lift, *others = plan.carrying
        held = grip.move(lift)
        stage.halt()
        held = held and all(grip.move(phase) for phase in others)
        if held:
            steps = step_outcomes(stage, grip)
        if held and plan.pushes:
            pushes = tuple(grip.push(direction) for direction in _PUSHES)
            if stage.parameters.twist_limit_nm > 0.0:
                twists = tuple(grip.twist(axis) for axis in _PUSHES)
        if held:
            all(grip.move(phase) for phase in plan.shakes)
    return _HoldOutcome(grip.control.mean_force_n, tuple(grip.phases), pushes, twists, grip.reason, steps)
