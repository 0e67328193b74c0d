"""The stand: springs that give their torque, a grip that stays, and a lift from a table."""

from contextlib import contextmanager

import numpy as np
import pybullet
import pytest

from graspbench.config.trial_config import load_config
from graspbench.evaluation.bodies import HandBodies
from graspbench.evaluation.judge import Judge
from graspbench.evaluation.protocols.protocol import stages_of
from graspbench.hand import load_hand
from graspbench.simulation.hold_stand import GRAVITY_M_S2, HoldStand
from graspbench.simulation.phases import smooth
from tests.evaluation.test_judge import above_ball, ball, radial

MASS_KG, FRICTION = 0.1, 0.6
UPWARDS = np.array([0.0, 0.0, -1.0])  # the palm points down on the ball, and its frame is the stand's
NEVER = lambda drift: False  # noqa: E731


@pytest.fixture(scope="module")
def grasp():
    hand, model = radial(), ball()
    record = above_ball(hand)
    return hand, model, stages_of(record, Judge(hand, model).judge([record])[0])


def displaced(x_m, y_m):
    error = np.eye(4)
    error[:2, 3] = x_m, y_m
    return error


@pytest.mark.parametrize("offset_mm", [(0.0, 0.0), (1.0, 0.0), (2.0, -1.5)])
def test_a_grip_without_load_stays_as_it_closed(offset_mm, grasp):
    hand, model, stages = grasp
    with HoldStand(hand, model) as stand:
        error = displaced(*(1e-3 * each for each in offset_mm))
        stand.grasp(stages, MASS_KG, FRICTION, transform_error=error)
        for _ in range(3):
            drift = stand.hold(np.zeros(3), 0.12, NEVER)
        assert drift.fingers == 3
        assert drift.moved_m < 5e-5
        assert drift.turned_deg < 0.1
        assert drift.slip_m < 5e-5


def test_a_finger_that_takes_no_part_stays_where_it_is():
    # Its description states damping of up to 10 N m s/rad, which no light link stands from step to step.
    hand = load_hand(load_config(["hand=allegro", "hand.fingers=3"]).hand)
    with HoldStand(hand, ball()) as stand:
        physics = stand._physics
        away = np.eye(4)
        away[0, 3] = 1.0
        physics.put(np.eye(4), hand.rest + 0.05, away)
        for _ in range(150):
            physics.step(np.eye(4), hand.rest)
        joints, speeds = physics.fingers.state()
    assert np.abs(speeds).max() < 0.1
    np.testing.assert_allclose(joints, hand.rest, atol=5e-3)


def test_contacts_at_rest_bear_exactly_the_springs_torques(grasp):
    hand, model, stages = grasp
    with HoldStand(hand, model) as stand:
        stand.grasp(stages, MASS_KG, FRICTION)
        stand.hold(np.zeros(3), 0.3, NEVER)
        physics = stand._physics
        joints, _ = physics.fingers.state()
        springs = stand.parameters.stiffness_nm_rad * (stages[-1].joints - joints)
        borne = np.zeros(hand.n_joints)
        points = pybullet.getContactPoints(
            physics.fingers.world.object_id, physics.fingers.body, physicsClientId=physics._client
        )
        palm, tips = physics.fingers.palm_pose(), hand.tip_positions(joints)
        bodies = HandBodies(hand)
        for contact in points:
            force = contact[9] * np.array(contact[7])
            force += contact[10] * np.array(contact[11]) + contact[12] * np.array(contact[13])
            at = np.array(contact[6])
            finger = int(np.argmin(np.linalg.norm(tips @ palm[:3, :3].T + palm[:3, 3] - at, axis=1)))
            last = int(hand.chains.counts[finger]) - 1
            borne += bodies.point_jacobian(palm, joints, finger, last, at).T @ force
        np.testing.assert_allclose(borne, springs, atol=0.01)
        assert np.abs(springs).max() > 0.1


@contextmanager
def on_a_table(stand, lowest_m):
    """A table under the object, and its weight from the beginning."""
    physics = stand._physics
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_PLANE, planeNormal=UPWARDS.tolist(), physicsClientId=physics._client
    )
    table = pybullet.createMultiBody(
        0.0, shape, basePosition=[0.0, 0.0, lowest_m], physicsClientId=physics._client
    )
    step, weight = physics.step, -MASS_KG * GRAVITY_M_S2 * UPWARDS
    physics.step = lambda palm, joints, force=None, torque=None: step(
        palm, joints, weight if force is None else force, torque
    )
    yield
    physics.step = step
    pybullet.removeBody(table, physicsClientId=physics._client)


@pytest.mark.parametrize("offset_mm", [(0.0, 0.0), (2.0, 1.0)])
def test_what_was_gripped_on_a_table_is_lifted_from_it(offset_mm, grasp):
    hand, model, stages = grasp
    object_to_stand = np.linalg.inv(stages[1].transform_palm_to_object)
    lowest = (np.asarray(model.mesh.vertices) @ object_to_stand[:3, :3].T + object_to_stand[:3, 3])[
        :, 2
    ].max()
    with HoldStand(hand, model) as stand, on_a_table(stand, lowest):
        error = displaced(*(1e-3 * each for each in offset_mm))
        stand.grasp(stages, MASS_KG, FRICTION, transform_error=error)
        low, before = stand.palm, stand.object_pose()[:3, 3]

        def rising(share):
            pose = low.copy()
            pose[:3, 3] += 0.1 * smooth(share) * UPWARDS
            return pose

        drift = stand.move(rising, -stand.weight_n * UPWARDS, 0.5, NEVER)
        assert (stand.object_pose()[:3, 3] - before) @ UPWARDS == pytest.approx(0.1, abs=1e-3)
        assert drift.moved_m < 1e-3
        assert drift.fingers == 3
