from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

from graspbench.errors import HandError, ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandParameters, HandPosture, load_hand
from graspbench.manipulation import charts
from graspbench.manipulation.clik import ClikParameters
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.held_object import hand_tree, hold_object
from graspbench.manipulation.manipulate import manipulate_object
from graspbench.manipulation.motion import MotionParameters
from graspbench.manipulation.reach import MAX_ROTATION_DEG, MAX_TRANSLATION_M, follow, reachable_range
from graspbench.reconstruction.network import build_network
from graspbench.reconstruction.surface import Surface

CONF = Path(__file__).parents[2] / "conf"
RADIUS = 0.030


@pytest.fixture(scope="module")
def hand():
    values = yaml.safe_load((CONF / "hand" / "allegro.yaml").read_text())
    return load_hand(TypeAdapter(HandParameters).validate_python({**values, "fingers": 3}))


@pytest.fixture(scope="module")
def ball_grasp(hand):
    """Three fingers on a ball; the palm is somewhere in the world."""
    centre = np.array([0.030, 0.0, 0.085])
    away = np.array([[-1.0, -0.3, 0.2], [0.7, -0.9, 0.1], [0.7, 0.9, 0.1]])
    away /= np.linalg.norm(away, axis=1)[:, None]
    targets = centre + (RADIUS + hand.tip_radius_m) * away
    joints = hand.joint_vector(
        np.array(
            [hand.finger_ik(f, targets[f], hand.preferred[hand.finger_joints(f)]).joints[0] for f in range(3)]
        )
    )
    palm = np.eye(4)
    palm[:3, :3] = Rotation.from_rotvec([3.0, 0.2, 0.1]).as_matrix()
    palm[:3, 3] = [0.1, 0.2, 0.3]

    def world(points):
        return points @ palm[:3, :3].T + palm[:3, 3]

    posture = HandPosture(palm, joints, (0, 1, 2), 0.0, 0.1, 0.01, 0.01)
    normals = away @ palm[:3, :3].T
    return Grasp(np.arange(3), world(centre + RADIUS * away), normals, world(centre), posture)


@pytest.fixture(scope="module")
def bumpy_surface(ball_grasp):
    """The ball as a reconstruction surface: nodes on meridians and parallels, in the world."""
    network = build_network(60, 59)
    v = np.pi / 2 - np.pi * np.arange(1, 60) / 60
    u = 2 * np.pi * np.arange(60) / 60
    uu, vv = np.meshgrid(u, v)
    ring = np.column_stack(
        [np.cos(vv.ravel()) * np.cos(uu.ravel()), np.cos(vv.ravel()) * np.sin(uu.ravel()), np.sin(vv.ravel())]
    )
    normals = np.vstack([[0, 0, 1.0], ring, [0, 0, -1.0]])
    points = ball_grasp.centroid + RADIUS * normals
    return Surface(points, normals, ball_grasp.centroid, network, 1, True)


@pytest.mark.parametrize("kind", ["rolling", "hard"])
def test_allegro_turns_and_carries_a_ball(hand, ball_grasp, bumpy_surface, kind):
    """0.1 mm, 0.1 deg along 5 s, and contacts within 1e-6 m of where their type lets them be."""
    clik = ClikParameters(step_s=5e-3, tasks={"joint_limit": {}, "joint_centring": {"gain": 0.3}})
    result = manipulate_object(
        hand, ball_grasp, bumpy_surface, MotionParameters(), clik, ContactParameters(kind=kind)
    )
    assert result.history.times[-1] == pytest.approx(5.0)
    assert result.position_error_m.max() <= 1e-4
    assert result.rotation_error_deg.max() <= 0.1
    assert result.contact_drift_m.max() <= 1e-6
    moved = np.linalg.norm(result.contact_points - result.contact_points[0], axis=2).max()
    assert (moved == 0.0) == (kind == "hard")
    middle = len(result.history.times) // 2
    there = result.transforms_object_to_palm[0, :3, 3] - result.transforms_object_to_palm[middle, :3, 3]
    assert np.linalg.norm(there) == pytest.approx(0.01, abs=1e-5)
    turn = result.transforms_object_to_palm[middle, :3, :3] @ result.transforms_object_to_palm[0, :3, :3].T
    assert np.rad2deg(Rotation.from_matrix(turn).magnitude()) == pytest.approx(10.0, abs=1e-3)
    # the joints alone, by another kinematics, hold the tips on the ball
    for k in (0, middle, -1):
        tips = hand.tip_positions(result.history.joints[k])
        pose = result.transforms_object_to_palm[k]
        local = (tips - pose[:3, 3]) @ pose[:3, :3]
        np.testing.assert_allclose(np.linalg.norm(local, axis=1), RADIUS + hand.tip_radius_m, atol=5e-5)
    assert np.all(result.history.joints <= hand.upper + 1e-9)


def test_forces_are_recorded_along_the_motion(hand, ball_grasp):
    chart = charts.sphere(RADIUS, towards=np.array([0.0, 0, 1]))
    contact = ContactParameters(kind="hard", mass_kg=0.05, force_rate_hz=10.0)
    short = MotionParameters(duration_s=0.5, translation_m=(0.0, 0.0, 0.002), rotation_deg=(0.0, 0.0, 1.0))
    each = [charts.sphere(RADIUS, towards=point - ball_grasp.centroid) for point in ball_grasp.points]
    result = manipulate_object(hand, ball_grasp, each, short, ClikParameters(step_s=5e-3), contact)
    assert len(result.force_times) == 6
    weight = 0.05 * 9.81
    up = ball_grasp.posture.transform_palm_to_world[:3, :3].T @ [0.0, 0.0, 1.0]
    balanced = np.isfinite(result.force_margins)
    assert balanced.any()
    total = result.forces[balanced].sum(axis=1)
    np.testing.assert_allclose(total @ up, weight, rtol=0.05)
    assert result.force_margins[balanced].min() >= -1e-6
    assert chart.name == "sphere"


def test_hand_tree_agrees_with_the_hand(hand):
    tree = hand_tree(hand, (2, 0))
    from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem

    system = ManipulationSystem(tree, [Contact(charts.plane(), "hard")] * 2)
    joints = np.random.default_rng(0).uniform(hand.lower, hand.upper)
    state = system.state(joints, np.zeros((2, 5)))
    np.testing.assert_allclose(state.tip_positions, hand.tip_positions(joints)[[2, 0]], atol=1e-12)
    np.testing.assert_allclose(state.tip_jacobians[:, :3], hand.tip_jacobians(joints)[[2, 0]], atol=1e-12)


def test_a_grasp_without_a_hand_is_refused(hand, ball_grasp, bumpy_surface):
    bare = Grasp(ball_grasp.vertices, ball_grasp.points, ball_grasp.normals, ball_grasp.centroid)
    with pytest.raises(HandError, match="no hand posture"):
        manipulate_object(hand, bare, bumpy_surface, MotionParameters(), ClikParameters())


def test_a_motion_out_of_reach_is_refused_with_how_far_it_can_go(hand, ball_grasp, bumpy_surface):
    far = MotionParameters(translation_m=(0.0, 0.0, 0.01), rotation_deg=(0.0, 0.0, 170.0))
    clik = ClikParameters(step_s=1e-2)
    with pytest.raises(ManipulationError, match=r"can follow only \d+ % of the motion, then") as caught:
        manipulate_object(hand, ball_grasp, bumpy_surface, far, clik)
    reach = caught.value.data["reach"]
    assert 0.0 < reach.share < 1.0
    np.testing.assert_allclose(reach.rotation_deg, [0.0, 0.0, 170.0 * reach.share])
    # what is said to be reachable is, and a little more is not
    within = replace(far, translation_m=tuple(reach.translation_m), rotation_deg=tuple(reach.rotation_deg))
    done = manipulate_object(hand, ball_grasp, bumpy_surface, within, clik)
    assert done.rotation_error_deg.max() <= 0.1
    beyond = replace(far, rotation_deg=(0.0, 0.0, 170.0 * reach.share + 10.0))
    with pytest.raises(ManipulationError, match="can follow only"):
        manipulate_object(hand, ball_grasp, bumpy_surface, beyond, clik)


def test_the_range_is_where_motions_end(hand, ball_grasp, bumpy_surface):
    held = hold_object(hand, ball_grasp, bumpy_surface, "rolling")
    clik = ClikParameters(tasks={"joint_limit": {}, "joint_centring": {"gain": 0.3}})
    entries = reachable_range(held, clik)
    assert [(e.kind, e.direction) for e in entries] == [
        (kind, sign + axis) for kind in ("translation", "rotation") for axis in "xyz" for sign in "+-"
    ]
    checked = 0
    for entry in entries:
        largest = MAX_TRANSLATION_M if entry.kind == "translation" else MAX_ROTATION_DEG
        assert 0.0 < entry.reach <= largest
        assert (entry.ended_by is None) == (entry.reach == largest)
        if entry.ended_by is None or checked >= 4:
            continue
        checked += 1
        axis, sign = "xyz".index(entry.direction[1]), 1.0 if entry.direction[0] == "+" else -1.0
        for share, reaches in ((0.9, True), (1.5, False)):  # a slower motion goes a little farther
            way = tuple(share * sign * entry.reach * np.eye(3)[axis])
            still = (0.0, 0.0, 0.0)
            motion = MotionParameters(
                translation_m=way if entry.kind == "translation" else still,
                rotation_deg=way if entry.kind == "rotation" else still,
                duration_s=10.0,
                there_and_back=False,
            )
            found, history = follow(held, motion, replace(clik, step_s=1e-2))
            assert (found.share == 1.0 and history is not None) == reaches
    assert checked
