"""A planned grasp played in the physics simulation: approach, approach, and what `lift` adds."""

import numpy as np

from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.simulation.approach import Approach
from graspbench.simulation.execution import ExecutionParameters, ExecutionResult
from graspbench.simulation.lift import hold_and_disturb
from graspbench.simulation.stage import JointPath, Stage, turn_deg
from graspbench.simulation.world import World


def execute(
    world: World, hand: HandModel, grasp: Grasp, path: JointPath, parameters: ExecutionParameters
) -> ExecutionResult:
    """Execute a planned grasp on the object in the world.

    The hand follows the path by position control. A finger that touches stops; after the path's end
    the others go on along the contact's normal. With ``until`` beyond "contact" the fingers then squeeze,
    lift and so on (`graspbench.simulation.lift`).

    Args:
        world: The object at rest on the table; it is changed by the execution.
        hand: The hand.
        grasp: The planned grasp; its posture tells which finger goes to which contact.
        path: The planned motion.
        parameters: How to execute.

    Raises:
        SimulationError: The simulation diverged.
        HandError: PyBullet cannot load the hand.
    """
    stage = Stage(world, hand, path, parameters)
    start = world.object_pose()
    fingers = grasp.posture.fingers if grasp.posture is not None else tuple(range(len(grasp.points)))
    approach = Approach(stage, grasp, fingers)
    tip_error = approach.follow(path)
    approach.close()
    reached = world.object_pose()
    displacement = float(np.linalg.norm(reached[:3, 3] - start[:3, 3]))
    made = sum(np.isfinite(approach.contact_time_s[f]) for f in fingers)
    reason = None if made == len(fingers) else f"only {made} of {len(fingers)} fingers touched the object"
    outcome = None
    if reason is None and parameters.until not in ("off", "contact"):
        outcome = hold_and_disturb(stage, fingers, [approach.touch[f] for f in fingers])
        reason = outcome.reason
    stage.sample()
    return ExecutionResult(
        success=reason is None,
        reason=reason,
        fingers=len(fingers),
        contacts_made=int(made),
        contact_time_s=tuple(float(approach.contact_time_s[f]) for f in fingers),
        contact_error_m=tuple(
            float(np.linalg.norm(approach.touch[f].point - point)) if f in approach.touch else np.nan
            for f, point in zip(fingers, grasp.points, strict=True)
        ),
        tip_error_max_m=tip_error,
        palm_error_max_m=stage.palm_error_max_m,
        object_displacement_m=displacement,
        object_turn_deg=turn_deg(start, reached),
        grip_force_n=0.0 if outcome is None else outcome.grip_force_n,
        phases=() if outcome is None else outcome.phases,
        pushes_weight=None if outcome is None else outcome.pushes_weight,
        time_s=stage.time_s,
        motion=stage.motion(),
    )
