"""A grasp lifted and then disturbed in many directions, harder and harder until it slips.

What comes out is a number for every direction that knows of no grasp quality measure: the study of what such
measures foretell rests on that.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.hand.touching import touching
from graspbench.simulation.approach import Approach
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.grip import Grip
from graspbench.simulation.phases import plan_lift
from graspbench.simulation.slip import SlipMeter
from graspbench.simulation.stage import JointPath, Stage
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import World

_LOOK_S = 0.01

FORCE_DIRECTIONS: FloatArray = np.vstack(
    (
        np.vstack((np.eye(3), -np.eye(3)))[[0, 3, 1, 4, 2, 5]],
        np.array(list(product((-1.0, 1.0), repeat=3))) / np.sqrt(3.0),
    )
)
"""To the faces and corners of a cube, world frame, shape (14, 3)."""

TORQUE_DIRECTIONS: FloatArray = FORCE_DIRECTIONS[:6]
"""About the axes, both ways, world frame, shape (6, 3)."""


@dataclass(frozen=True)
class GradedResult:
    """What a grasp withstood.

    Attributes:
        held: Whether all fingers touched and the object was in the hand after squeeze, lift and hold.
        reason: Why not, one clause; None if it was.
        forces_weight: Largest force resisted in each of `FORCE_DIRECTIONS`, multiples of the weight; all 0
            where the object was not held, shape (14,).
        torques_weight: Largest torque resisted about each of `TORQUE_DIRECTIONS`, multiples of weight times
            lever, shape (6,).
        grip_force_n: Mean normal force of a finger, 0 where it came to no squeeze.
        contact_error_m: Largest distance of a real contact from the planned one; nan where one is missing.
    """

    held: bool
    reason: str | None
    forces_weight: FloatArray
    torques_weight: FloatArray
    grip_force_n: float
    contact_error_m: float


def quick(parameters: ExecutionParameters) -> ExecutionParameters:
    """Return parameters with a low, short lift and quick pushes: little else is asked of an execution."""
    return replace(
        parameters,
        until="pushes",
        lift_height_m=0.06,
        lift_time_s=0.4,
        hold_time_s=0.2,
        push_limit=6.0,
        push_time_s=0.3,
    )


def execute_graded(
    world: World,
    hand: HandModel,
    grasp: Grasp,
    path: JointPath,
    parameters: ExecutionParameters,
    friction: TipFriction,
    lever_m: float,
) -> GradedResult:
    """Execute a planned grasp, lift the object a little, and disturb it in every direction.

    Args:
        world: The object at rest on the table; it is changed by the execution.
        hand: The hand.
        grasp: The planned grasp, with its posture.
        path: The planned motion.
        parameters: How to execute; ``push_limit`` is the largest force, multiples of the weight.
        friction: Between fingertips and object.
        lever_m: Makes a torque of a force, m.

    Raises:
        SimulationError: The simulation diverged.
        HandError: PyBullet cannot load the hand.
    """
    assert grasp.posture is not None, "a grasp that is executed has a posture"
    hand = touching(hand, grasp.posture, grasp.normals)
    stage = Stage(world, hand, path, parameters, friction, plan_lift)
    fingers = grasp.posture.fingers
    approach = Approach(stage, grasp, fingers)
    approach.follow(path)
    approach.close()
    made = [f for f in fingers if np.isfinite(approach.contact_time_s[f])]
    if len(made) < len(fingers):
        return _lost(f"only {len(made)} of {len(fingers)} fingers touched the object", 0.0, np.nan)
    error_m = max(
        float(np.linalg.norm(approach.touch[f].point - point))
        for f, point in zip(fingers, grasp.points, strict=True)
    )
    grip = Grip(stage, fingers, [approach.touch[f] for f in fingers])
    if not (grip.squeeze() and all(grip.move(phase) for phase in stage.phases().carrying)):
        return _lost(str(grip.reason), grip.control.mean_force_n, error_m)
    _leave_table(stage)
    nothing = np.zeros(3)
    return GradedResult(
        held=True,
        reason=None,
        forces_weight=np.array([_ramp(stage, grip, fingers, axis, nothing) for axis in FORCE_DIRECTIONS]),
        torques_weight=np.array(
            [_ramp(stage, grip, fingers, nothing, lever_m * axis) for axis in TORQUE_DIRECTIONS]
        ),
        grip_force_n=grip.control.mean_force_n,
        contact_error_m=error_m,
    )


def _leave_table(stage: Stage) -> None:
    """Take the table away from under hand and object: lifted, they meet it no more, and it costs a fifth."""
    world, hand = stage.world, stage.hand
    pybullet.setCollisionFilterPair(world.object_id, world.table_id, -1, -1, 0, physicsClientId=world.client)
    for link in range(-1, pybullet.getNumJoints(hand.body, physicsClientId=world.client)):
        pybullet.setCollisionFilterPair(hand.body, world.table_id, link, -1, 0, physicsClientId=world.client)


def _lost(reason: str, grip_force_n: float, contact_error_m: float) -> GradedResult:
    return GradedResult(
        False,
        reason,
        np.zeros(len(FORCE_DIRECTIONS)),
        np.zeros(len(TORQUE_DIRECTIONS)),
        grip_force_n,
        contact_error_m,
    )


def _ramp(
    stage: Stage, grip: Grip, fingers: tuple[int, ...], force: FloatArray, torque_m: FloatArray
) -> float:
    """Disturb harder and harder until a contact slides; return how hard, in weights. Undone afterwards."""
    p, world = stage.parameters, stage.world
    client = world.client
    weight_n = world.object_model.mass_kg * world.scene.gravity
    saved = pybullet.saveState(physicsClientId=client)
    memory = grip.control.memory()
    before, slip = grip.object_in_palm(), SlipMeter(stage.hand, fingers, p.contact_force_n)
    slip.look()
    steps = max(1, round(p.push_time_s / stage.time_step_s))
    look = max(1, round(_LOOK_S / stage.time_step_s))
    resisted = 0.0
    for k in range(1, steps + 1):
        weights = p.push_limit * k / steps
        if np.any(force):
            centre = world.object_pose()[:3, 3].tolist()
            pybullet.applyExternalForce(
                world.object_id,
                -1,
                (weights * weight_n * force).tolist(),
                centre,
                pybullet.WORLD_FRAME,
                physicsClientId=client,
            )
        if np.any(torque_m):
            pybullet.applyExternalTorque(
                world.object_id,
                -1,
                (weights * weight_n * torque_m).tolist(),
                pybullet.WORLD_FRAME,
                physicsClientId=client,
            )
        grip.control.drive(grip.palm, 1.0, 1.0)
        pybullet.stepSimulation(physicsClientId=client)
        if k % look == 0:
            slip.look()
            drift = np.linalg.norm(grip.object_in_palm()[:3, 3] - before[:3, 3])
            if slip.slip_m > p.push_slip_m or drift > p.slip_limit_m:
                break
            resisted = weights
    pybullet.restoreState(stateId=saved, physicsClientId=client)
    pybullet.removeState(saved, physicsClientId=client)
    grip.control.recall(memory)
    return float(resisted)
