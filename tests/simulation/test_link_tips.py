"""The simulated hand touches where it was planned to, with the links' real shapes."""

import numpy as np
import pytest

from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import GraspChecker, load_hand
from graspbench.simulation import SceneParameters, World
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction
from tests.hand.tip_hands import BOX, CYLINDER, pad_mesh, tip_hand

CENTRE = np.array([0.0, 0.0, 0.5])
HALF = np.array([0.025, 0.03, 0.04])


def on_ball():
    angles = 2 * np.pi * np.arange(3) / 3
    normals = np.column_stack([np.cos(angles), np.sin(angles), [0.1, -0.1, 0.05]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return CENTRE + 0.03 * normals, normals


def on_box():
    normals = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0]])
    points = CENTRE + HALF * normals + [[0, 0.004, 0.01], [0, -0.006, 0.01], [0.005, 0, 0.012]]
    return points, normals


@pytest.mark.parametrize("tip", ["box", "cylinder", "mesh"])
@pytest.mark.parametrize("body", ["ball", "box"])
def test_contacts_agree_within_a_tenth_of_a_millimetre(tmp_path, tip, body):
    geometry = {"box": BOX, "cylinder": CYLINDER}.get(tip) or pad_mesh(tmp_path / "pad.stl")
    hand = load_hand(tip_hand(tmp_path, geometry))
    points, normals = on_ball() if body == "ball" else on_box()
    posture = GraspChecker(hand, None).place(points, normals)
    assert posture is not None
    with World(load_object(ObjectParameters(name="cylinder")), SceneParameters(), 0) as world:
        mount = FloatingWrist(hand, posture.transform_palm_to_world, np.array([1.0, 0.0, 0.0]))
        simulated = SimulatedHand(world, hand, mount, posture.joints, TipFriction(0.5, 0.002, 0.5))
        kinds = {
            "ball": {"shapeType": pybullet.GEOM_SPHERE, "radius": 0.03},
            "box": {"shapeType": pybullet.GEOM_BOX, "halfExtents": HALF.tolist()},
        }
        shape = pybullet.createCollisionShape(**kinds[body], physicsClientId=world.client)
        there = pybullet.createMultiBody(0, shape, basePosition=CENTRE.tolist(), physicsClientId=world.client)
        pybullet.changeDynamics(there, -1, collisionMargin=1e-4, physicsClientId=world.client)
        for finger, point, normal in zip(posture.fingers, points, normals, strict=True):
            centre = simulated._tip_ids[finger]  # a frame on the link that touches
            link = pybullet.getJointInfo(simulated.body, centre, physicsClientId=world.client)[16]
            found = pybullet.getClosestPoints(
                simulated.body, there, 0.002, linkIndexA=link, physicsClientId=world.client
            )
            assert found, "the link is there"
            nearest = min(found, key=lambda each: each[8])
            assert abs(nearest[8]) < 1e-4
            assert abs((np.array(nearest[6]) - point) @ normal) < 1e-4
            if body == "ball":  # on a flat face anything that is as near is as good
                assert np.linalg.norm(np.array(nearest[6]) - point) < 1e-4
