"""Finger gaiting: turns beyond what one grasp allows, checked without the planner."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter

from graspbench.errors import ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandParameters, HandPosture, load_hand
from graspbench.manipulation import charts
from graspbench.manipulation.clik import ClikParameters
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.gaiting.gait import gait_object
from graspbench.manipulation.gaiting.gait_check import check_gait
from graspbench.manipulation.gaiting.gait_parameters import GaitParameters
from graspbench.manipulation.gaiting.turning import grasp_normal
from graspbench.reconstruction.network import build_network
from graspbench.reconstruction.surface import Surface

CONF = Path(__file__).parents[2] / "conf"
RADIUS = 0.030
TASKS = {"joint_limit": {"gain": 20.0, "margin": 0.1}, "joint_centring": {"gain": 0.5}}
CLIK = ClikParameters(step_s=1e-2, integrator="rk4", tasks=TASKS)
CONTACT = ContactParameters(mass_kg=0.05, force_rate_hz=10.0)


def radial(fingers):
    values = yaml.safe_load((CONF / "hand" / "radial.yaml").read_text())
    return load_hand(TypeAdapter(HandParameters).validate_python({**values, "fingers": fingers}))


def ball_in(hand):
    """A ball held by all fingers of a radial hand from above, and its surface."""
    preferred = hand.tip_positions(hand.preferred)
    centre = np.array([0.0, 0.0, preferred[0, 2]])
    away = preferred - centre
    away /= np.linalg.norm(away, axis=1)[:, None]
    joints = [
        hand.finger_ik(
            f, centre + (RADIUS + hand.tip_radius_m) * away[f], hand.preferred[hand.finger_joints(f)]
        ).joints[0]
        for f in range(hand.n_fingers)
    ]
    palm = np.diag([1.0, -1.0, -1.0, 1.0])
    palm[:3, 3] = [0.1, 0.2, 0.3]

    def world(points):
        return points @ palm[:3, :3].T + palm[:3, 3]

    fingers = tuple(range(hand.n_fingers))
    posture = HandPosture(palm, hand.joint_vector(np.array(joints)), fingers, 0.0, 0.1, 0.01, 0.01)
    grasp = Grasp(
        np.arange(hand.n_fingers),
        world(centre + RADIUS * away),
        away @ palm[:3, :3].T,
        world(centre),
        posture,
    )
    n = 30
    v = np.pi / 2 - np.pi * np.arange(1, n) / n
    u = 2 * np.pi * np.arange(n) / n
    u, v = (each.ravel() for each in np.meshgrid(u, v))
    ring = np.column_stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])
    normals = np.vstack([[0, 0, 1.0], ring, [0, 0, -1.0]])
    network = build_network(n, n - 1)
    return grasp, Surface(grasp.centroid + RADIUS * normals, normals, grasp.centroid, network, 1, True)


def on_ball(point, normal):
    return charts.sphere(RADIUS, towards=point)


@pytest.fixture(scope="module")
def hand():
    return radial(4)


@pytest.fixture(scope="module")
def gait(hand):
    """More than half a turn: fingers have to step, links would cross otherwise."""
    grasp, surface = ball_in(hand)
    asked = GaitParameters(angle_deg=-170.0, turn_speed_deg_s=40.0, step_time_s=0.5)
    result = gait_object(hand, grasp, surface, asked, CLIK, CONTACT, chart_at=on_ball)
    return grasp, surface, result


def test_a_ball_is_turned_farther_than_one_grasp_allows(gait):
    _, _, result = gait
    assert result.turned_deg[-1] == pytest.approx(-170.0)
    assert len(result.steps) >= 4
    assert result.position_error_m.max() <= 1e-4
    assert result.rotation_error_deg.max() <= 0.1
    assert (np.diff(result.history.times) > 0).all()
    for step in result.steps:
        inside = (result.history.times > step.from_s + 1e-9) & (result.history.times < step.to_s - 1e-9)
        assert inside.any()
        assert not result.touching[inside, step.contact].any()
        others = np.delete(np.arange(4), step.contact)
        assert result.touching[np.ix_(inside, others)].all()
        # the object is at rest meanwhile
        assert np.ptp(result.turned_deg[inside]) == 0.0
    # no joint jumps where one motion follows another
    assert np.abs(np.diff(result.history.joints, axis=0)).max() < 0.06


def test_tips_keep_to_the_ball_in_closed_form(hand, gait):
    """By another kinematics: tips that touch are a radius outside the ball, the others farther off."""
    _, _, result = gait
    centre = result.desired_transforms_object_to_palm[0, :3, 3]
    for k in range(0, len(result.history.times), 7):
        away = np.linalg.norm(hand.tip_positions(result.history.joints[k]) - centre, axis=1)
        on = result.touching[k]
        np.testing.assert_allclose(away[on], RADIUS + hand.tip_radius_m, atol=1e-6)
        assert (away[~on] >= RADIUS + hand.tip_radius_m - 1e-6).all()
    step = result.steps[0]
    middle = int(np.searchsorted(result.history.times, 0.5 * (step.from_s + step.to_s)))
    lifted = hand.tip_positions(result.history.joints[middle])[step.contact]
    assert np.linalg.norm(lifted - centre) - RADIUS - hand.tip_radius_m >= 0.009


def test_the_check_finds_nothing_wrong(hand, gait):
    grasp, surface, result = gait
    found = check_gait(hand, grasp, surface, result, CONTACT)
    assert found.violations == ()
    assert found.turned_deg == pytest.approx(-170.0, abs=0.1)
    assert found.slip_max_m < 1e-5
    assert found.joint_margin_min_deg > 0.0
    assert found.speed_share_max <= 1.0
    # friction is left at every moment, also with a finger off
    assert found.friction_margin_min_n > 0.0
    assert result.force_margins.min() == pytest.approx(found.friction_margin_min_n, abs=1e-9)


@pytest.mark.parametrize("fault", ["joints", "path", "contact", "force", "limit", "speed"])
def test_the_check_finds_faults_put_in(hand, gait, fault):
    grasp, surface, result = gait
    k = len(result.history.times) // 2
    joints = result.history.joints.copy()
    spoilt, word = result, ""
    if fault == "joints":  # a finger is turned off its contact for a moment
        on = int(np.flatnonzero(result.touching[k])[0])
        joints[k, hand.finger_joints(on)[1]] += 0.01
        spoilt, word = replace(result, history=replace(result.history, joints=joints)), "off its contact"
    elif fault == "path":
        poses = result.desired_transforms_object_to_palm.copy()
        poses[k:, 0, 3] += 2e-4
        spoilt, word = replace(result, desired_transforms_object_to_palm=poses), "off its path"
    elif fault == "contact":  # contacts that drift over the ball, as if tips slid
        points, normals = result.contact_points.copy(), result.contact_normals.copy()
        turn = np.eye(3)
        turn[:2, :2] = [[np.cos(0.02), -np.sin(0.02)], [np.sin(0.02), np.cos(0.02)]]
        points[k:], normals[k:] = points[k:] @ turn.T, normals[k:] @ turn.T
        spoilt, word = replace(result, contact_points=points, contact_normals=normals), "off its path"
    elif fault == "force":
        spoilt, word = replace(result, forces=0.9 * result.forces), "times the weight"
    elif fault == "limit":
        tight = replace(hand, upper=joints.max(axis=0) - 0.02)
        assert any("beyond its limit" in each for each in check_gait(tight, *gait, CONTACT).violations)
        return
    else:
        slow = replace(hand, velocity_limits=0.3 * hand.velocity_limits)
        assert any("as fast as it can" in each for each in check_gait(slow, *gait, CONTACT).violations)
        return
    assert any(word in each for each in check_gait(hand, grasp, surface, spoilt, CONTACT).violations)


def test_three_fingers_are_refused_with_how_far_they_go():
    """Of three fingers a third of a turn apart two do not hold the ball with this friction."""
    hand = radial(3)
    grasp, surface = ball_in(hand)
    asked = GaitParameters(angle_deg=200.0, turn_speed_deg_s=60.0)
    with pytest.raises(ManipulationError, match="can turn the object only") as caught:
        gait_object(hand, grasp, surface, asked, CLIK, CONTACT, chart_at=on_ball)
    turned = np.floor(caught.value.data["turned_deg"])
    assert 5.0 < turned < 200.0
    within = replace(asked, angle_deg=turned)
    done = gait_object(hand, grasp, surface, within, CLIK, CONTACT, chart_at=on_ball)
    assert done.turned_deg[-1] == pytest.approx(turned)
    assert done.steps == ()


@pytest.mark.parametrize("kind", ["frictionless", "soft_pad"])
def test_contacts_that_cannot_gait_are_refused(hand, kind):
    grasp, surface = ball_in(hand)
    with pytest.raises(ManipulationError, match=f"do not gait on contacts of kind '{kind}'"):
        gait_object(hand, grasp, surface, GaitParameters(60.0), CLIK, ContactParameters(kind=kind))


def test_the_normal_of_a_grasp_points_to_the_palm():
    points = np.array([[1.0, 0, 0.5], [0, 1.0, 0.5], [-1.0, 0, 0.5]])
    np.testing.assert_allclose(grasp_normal(points), [0, 0, -1.0], atol=1e-12)
