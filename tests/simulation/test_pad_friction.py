"""Torsional friction in Bullet against its closed form, and soft pads whose torque follows the load."""

import numpy as np
import pybullet
import pytest

from graspbench.grasp.soft_pad import PadParameters
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.approach import Approach
from graspbench.simulation.grip import Grip
from graspbench.simulation.simulated_hand import spinning_friction
from graspbench.simulation.stage import Stage
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import SPINNING_FRICTION_M
from tests.simulation.test_grasp_execution import cylinder, hand, planned  # noqa: F401


@pytest.fixture
def client():
    found = pybullet.connect(pybullet.DIRECT)
    yield found
    pybullet.disconnect(found)


@pytest.mark.parametrize("load_n", [1.0, 8.0])
@pytest.mark.parametrize("object_friction", [0.4, 1.0])
def test_a_pad_turns_at_the_torque_of_its_patch(client, load_n, object_friction):
    """A plate is pressed on a fingertip; the torque that turns it is mu k c N^(1 + g)."""
    friction, pad = 0.5, PadParameters()
    own = friction / object_friction
    pybullet.setTimeStep(1e-3, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(numSolverIterations=200, physicsClientId=client)
    ball = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=0.008, physicsClientId=client)
    tip = pybullet.createMultiBody(0, ball, physicsClientId=client)
    plate = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=[0.03, 0.03, 0.01], physicsClientId=client
    )
    body = pybullet.createMultiBody(0.1, plate, basePosition=[0, 0, 0.018], physicsClientId=client)
    torsion_m = pad.torsion_m(load_n, friction)
    spinning = spinning_friction(torsion_m, own, object_friction)
    for each, lateral, spin in ((tip, own, spinning), (body, object_friction, SPINNING_FRICTION_M)):
        pybullet.changeDynamics(
            each,
            -1,
            lateralFriction=lateral,
            spinningFriction=spin,
            angularDamping=0.0,
            physicsClientId=client,
        )
    expected = friction * (3 * np.pi / 16) * 0.0025 * load_n ** (4 / 3)
    for k in range(4000):
        at = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0]
        pybullet.applyExternalForce(
            body, -1, [0, 0, -load_n], at, pybullet.WORLD_FRAME, physicsClientId=client
        )
        torque = 1.2 * expected * max(k - 500, 0) / 3500
        pybullet.applyExternalTorque(body, -1, [0, 0, torque], pybullet.WORLD_FRAME, physicsClientId=client)
        pybullet.stepSimulation(physicsClientId=client)
        if (
            pybullet.getBaseVelocity(body, physicsClientId=client)[1][2] > 3e-4
        ):  # slow: a plate that turns has taken up torque
            break
    assert torque == pytest.approx(expected, rel=0.01)


def test_fingers_torsion_follows_the_force_that_is_felt(hand):  # noqa: F811
    model, pad = cylinder(), PadParameters()
    grasp, path = planned(hand, model)
    friction = TipFriction(0.5, pad.torsion_m(5.0, 0.5), 0.5, pad)
    with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
        stage = Stage(world, hand, path, ExecutionParameters(), friction)
        approach = Approach(stage, grasp, grasp.posture.fingers)
        approach.follow(path)
        approach.close()
        grip = Grip(stage, grasp.posture.fingers, [approach.touch[f] for f in grasp.posture.fingers])
        assert grip.squeeze()
        grip.move(stage.phases().carrying[0])
        touches = stage.hand.touches(0.05)
        for finger, touch in enumerate(touches):
            link = stage.hand._tip_ids[finger]
            spin = pybullet.getDynamicsInfo(stage.hand.body, link, physicsClientId=world.client)[7]
            own = friction.coulomb / model.friction
            torsion_m = spin * model.friction + SPINNING_FRICTION_M * own
            assert touch.force_n > 0.5
            assert torsion_m == pytest.approx(pad.torsion_m(touch.force_n, 0.5), rel=0.01)
