"""Fingers that step while others hold the object, in physics: four around a cylinder, one leaves it."""

from types import SimpleNamespace

import numpy as np
import pytest

from graspbench.geometry import ObjectParameters, load_object
from graspbench.grasp.configuration import Grasp
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.in_hand import play_in_hand
from graspbench.simulation.in_hand_path import InHandPath, StepOnPath
from graspbench.simulation.tip_friction import TipFriction

FROM_S, TO_S, END_S = 0.2, 0.8, 1.0
LIFT_M = 0.012


@pytest.fixture(scope="module")
def held():
    """A cylinder, a hand of four fingers around its middle, and a path that closes onto it."""
    hand, model = load_hand(HandParameters(fingers=4)), load_object(ObjectParameters(name="cylinder"))
    low, high = model.mesh.bounds
    radius, height = 0.5 * (high[0] - low[0]), 0.5 * (high[2] - low[2])
    angles = 0.5 * np.pi * np.arange(4)
    normals = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(4)))
    points = radius * normals + [0, 0, height]
    posture = GraspChecker(hand, 0.0).place(points, normals)
    assert posture is not None
    grasp = Grasp(np.arange(4), points, normals, np.array([0, 0, height]), posture)
    opened = posture.joints.copy()
    for contact in range(4):
        opened = lifted(hand, grasp, opened, contact, 0.01)
    palm = posture.transform_palm_to_world
    path = SimpleNamespace(
        times=np.array([0.0, 0.4]),
        joints=np.stack((opened, posture.joints)),
        transform_palm_to_world=np.stack((palm, palm)),
    )
    return hand, model, grasp, path


def lifted(hand, grasp, joints, contact, lift_m):
    """Return joints with a finger's tip off its contact along the normal."""
    palm, finger = grasp.posture.transform_palm_to_world, grasp.posture.fingers[contact]
    own = hand.finger_joints(finger)
    away = grasp.points[contact] + (hand.tip_radius_m + lift_m) * grasp.normals[contact]
    out = joints.copy()
    out[own] = hand.finger_ik(finger, (away - palm[:3, 3]) @ palm[:3, :3], joints[own]).joints[0]
    return out


def stepping(hand, grasp, returning=True, opening=()):
    """Return a path on which finger 0 steps on the object at rest; others may open, which nobody is told."""
    rest = grasp.posture.joints
    up = lifted(hand, grasp, rest, 0, LIFT_M)
    end = rest.copy() if returning else lifted(hand, grasp, rest, 0, 0.03)
    for contact in opening:
        own = hand.finger_joints(grasp.posture.fingers[contact])
        up[own] = end[own] = hand.rest[own]
    rotation = grasp.posture.transform_palm_to_world[:3, :3]
    step = StepOnPath(0, FROM_S, TO_S, -rotation.T @ grasp.normals[0])
    times = np.array([0.0, FROM_S, 0.5 * (FROM_S + TO_S), TO_S, END_S])
    return InHandPath(
        times,
        np.stack((rest, rest, up, end, end)),
        np.broadcast_to(np.eye(4), (5, 4, 4)),
        np.array([0.0, 0.0, 1.0]),
        (step,),
    )


def play(held, path):
    hand, model, grasp, approach = held
    p = ExecutionParameters(lift_time_s=0.5, hold_time_s=0.1)
    with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
        return play_in_hand(world, hand, grasp, approach, path, p, TipFriction(0.5, 0.002, planned=0.5))


def test_three_fingers_hold_while_one_steps(held):
    hand, _, grasp, _ = held
    played = play(held, stepping(hand, grasp))
    assert played.success, played.reason
    assert (played.steps, played.steps_missed) == (1, 0)
    phase = played.phases[-1]
    assert (phase.contacts, phase.contacts_lost) == (4, 1)  # it was off, and is on again
    assert played.position_error_m.max() < 1e-3
    assert played.slips_m.shape == (4,)
    assert played.slips_m.max() < 1e-3
    assert played.turned_about_axis_deg == pytest.approx(0.0, abs=2.0)
    # the path waits for letting go, landing and taking hold
    assert played.times[-1] > END_S + 0.5


def test_a_finger_that_does_not_find_the_object_is_told(held):
    hand, _, grasp, _ = held
    played = play(held, stepping(hand, grasp, returning=False))
    assert (played.steps, played.steps_missed) == (1, 1)
    assert played.success, played.reason
    assert played.phases[-1].contacts == 3


def test_an_object_is_lost_where_too_few_fingers_hold_it(held):
    """Three leave, of whom one is said to step: the last one holds nothing by itself."""
    hand, _, grasp, _ = held
    played = play(held, stepping(hand, grasp, opening=(1, 3)))
    assert not played.success
    assert "in phase in_hand" in played.reason
    assert not played.phases[-1].held


def test_a_finger_that_slides_presses_as_it_shall_where_the_surface_is_not_where_it_was_seen(held):
    """Its path leads 3 mm into the object: springs that did not give way would push with newtons."""
    hand, _, grasp, _ = held
    rest, inside = grasp.posture.joints, lifted(hand, grasp, grasp.posture.joints, 0, -0.003)
    joints, times = np.stack((rest, rest, inside, inside)), np.array([0.0, 0.2, END_S, 2 * END_S])
    poses = np.broadcast_to(np.eye(4), (4, 4, 4))
    result = play(held, InHandPath(times, joints, poses, sliding=(0,), sliding_n=0.2))
    assert result.success, result.reason
    assert result.position_error_m[-1] < 0.0002
