"""A finger presses with what its torque makes, however light its links, and whether joints follow or not."""

import numpy as np
import pytest

from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import FingerDescription, HandParameters, PalmDescription, load_hand
from graspbench.simulation import SceneParameters, World
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction
from tests.hand.small_hands import INERTIAL, PALM, fingers, one_joint_coupled, two_joints, written

STONE_M, TORQUE_NM = 0.004, 0.4
LIGHT = INERTIAL.replace("0.03", "0.004").replace("1e-5", "5e-7")


@pytest.fixture(params=[INERTIAL, LIGHT], ids=["30 g", "4 g"])
def inertial(request):
    return request.param


@pytest.mark.parametrize("kind", [one_joint_coupled, two_joints])
def test_a_finger_presses_with_what_its_torque_makes(tmp_path, inertial, kind):
    text = PALM + fingers(2, kind).replace(INERTIAL, inertial)
    hand = load_hand(
        HandParameters(
            name="small",
            kind="urdf",
            urdf=str(written(tmp_path / "small.urdf", text)),
            fingers=2,
            palm=PalmDescription("palm"),
            chains=tuple(FingerDescription(n, f"{n}_b", (0.0, 0.0, 0.045)) for n in "fg"),
        )
    )
    joints = hand.lower + 0.3 * (hand.upper - hand.lower)  # clear of the other finger
    pose = np.eye(4)
    pose[2, 3] = 1.0
    with World(load_object(ObjectParameters(name="cylinder")), SceneParameters(), 0) as world:
        pybullet.setGravity(0, 0, 0, physicsClientId=world.client)
        mount = FloatingWrist(hand, pose, np.array([1.0, 0.0, 0.0]))
        body = SimulatedHand(world, hand, mount, joints, TipFriction(0.5, 0.002, 0.5))
        lever_m, force_n = press_a_stone(world, hand, body, joints)
    assert force_n == pytest.approx(TORQUE_NM / lever_m, rel=0.02)


def press_a_stone(world, hand, body, joints):
    """Let a finger's last joint press its tip on a fixed, slippery stone; return its lever and the force."""
    tip, turning = hand.tip_positions(joints)[0], hand.finger_joints(0)[-1:]
    column = hand.tip_jacobians(joints)[0][:, turning[0]]
    lever_m = float(np.linalg.norm(column))
    direction = column / lever_m
    at = tip + (hand.tip_radius_m + STONE_M) * direction + [0.0, 0.0, 1.0]
    client = world.client
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=STONE_M, physicsClientId=client)
    stone = pybullet.createMultiBody(0, shape, basePosition=at.tolist(), physicsClientId=client)
    pybullet.changeDynamics(stone, -1, lateralFriction=0.0, physicsClientId=client)
    torques, nothing = np.zeros(hand.n_joints), np.zeros(hand.n_joints)
    for k in range(200):  # it grows, as a grip does
        torques[turning] = TORQUE_NM * min(1.0, (k + 1) / 100)
        body.drive_wrist(body.palm_goal, 0.002)
        body.drive_compliantly(torques, nothing, nothing, turning)
        pybullet.stepSimulation(physicsClientId=client)
    contacts = pybullet.getContactPoints(body.body, stone, physicsClientId=client)
    return lever_m, sum(contact[9] for contact in contacts)
