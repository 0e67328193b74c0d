"""A grasp that only feels: the fingers close till they touch, and the hand withdraws."""

from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.hand.touching import touching
from graspbench.simulation.approach import Approach
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.stage import JointPath, Stage
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import World


@dataclass(frozen=True)
class FeltGrasp:
    """What the fingers felt.

    Attributes:
        contacts: Points and INWARD normals in the world, in the order of the grasp's contacts, shape
            (n, 2, 3); None where a finger met nothing.
        time_s: Simulated time from the start to the hand's withdrawal.
    """

    contacts: FloatArray | None
    time_s: float


@dataclass(frozen=True)
class _Withdrawal:
    times: FloatArray
    joints: FloatArray
    transform_palm_to_world: FloatArray


def feel_grasp(
    world: World,
    hand: HandModel,
    grasp: Grasp,
    path: JointPath,
    closing: int,
    parameters: ExecutionParameters,
    friction: TipFriction,
) -> FeltGrasp:
    """Close the hand on the object till every finger touches, and withdraw it.

    Args:
        world: The object at rest on the table, and no hand; the hand stays in it, clear of the object.
        hand: The hand.
        grasp: The grasp to feel; its posture tells which finger goes to which contact.
        path: The planned motion.
        closing: First sample of the path's last approach, where the open hand floats over the object.
        parameters: How to execute.
        friction: Between fingertips and object.

    Raises:
        SimulationError: The simulation diverged.
        HandError: PyBullet cannot load the hand.
    """
    assert grasp.posture is not None
    fingers = grasp.posture.fingers
    hand = touching(hand, grasp.posture, grasp.normals)
    stage = Stage(world, hand, path, replace(parameters, until="contact"), friction)
    approach = Approach(stage, grasp, fingers)
    approach.follow(path)
    approach.close()
    contacts = None
    if all(f in approach.touch for f in fingers):
        contacts = np.array([(approach.touch[f].point, approach.touch[f].normal) for f in fingers])
    Approach(stage, grasp, fingers).follow(_withdrawal(path, closing, stage.hand.state()[0]), arriving=False)
    return FeltGrasp(contacts, stage.time_s)


def _withdrawal(path: JointPath, closing: int, joints: FloatArray) -> _Withdrawal:
    """Return the last approach backwards, from the posture, shape (n_q,), in which the fingers touch."""
    back = slice(None, closing - 1 if closing else None, -1)
    planned = path.joints[back]
    left = np.linspace(1.0, 0.0, len(planned))[:, None]
    return _Withdrawal(
        path.times[closing:] - path.times[closing],
        planned + left * (joints - planned[0]),
        path.transform_palm_to_world[back],
    )
