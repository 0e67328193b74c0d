"""Grasps held on links' real shapes: found, judged by others, and refused where they are not so."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from graspbench.compiled import compiled
from graspbench.errors import HandError
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.hand.collision import place_hand
from graspbench.hand.gaps import collect_tips
from graspbench.hand.obstacle import make_obstacle
from graspbench.hand.placement import _tip_row
from graspbench.hand.task import SHARPNESS, Task, make_system
from graspbench.hand.touching import touching
from graspbench.hand.verification import verify_posture
from tests.hand.tip_hands import BOX, CYLINDER, pad_mesh, tip_hand
from tests.oracles.hand_posture import judge

RADIUS_M = 0.03
CENTRE = np.array([0.0, 0.0, 0.07])


@pytest.fixture(scope="module", params=["box", "cylinder", "mesh"])
def parameters(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    shapes = {"box": BOX, "cylinder": CYLINDER}
    geometry = shapes[request.param] if request.param in shapes else pad_mesh(folder / "pad.stl")
    return tip_hand(folder, geometry)


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS_M)
    mesh.apply_translation(CENTRE)
    return mesh


def contacts(seed):
    generator = np.random.default_rng(seed)
    angles = 2 * np.pi * np.arange(3) / 3 + generator.uniform(0, 6)
    normals = np.column_stack([np.cos(angles), np.sin(angles), generator.normal(0, 0.15, 3)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return CENTRE + RADIUS_M * normals, normals


@pytest.mark.parametrize("seed", range(3))
def test_a_grasp_on_real_links_stands_before_all_judges(parameters, ball, seed):
    hand = load_hand(parameters)
    assert hand.urdf_path.read_text().count("<sphere") == 0  # nothing was added
    checker = GraspChecker(hand)
    checker.set_object(np.asarray(ball.vertices), np.asarray(ball.faces))
    points, normals = contacts(seed)
    posture = checker.place(points, normals)
    assert posture is not None, checker.reason(points, normals)
    assert verify_posture(hand, posture, points, normals, object_mesh=ball) == ()
    judgement = judge(parameters, hand, posture, points, normals, ball)
    assert judgement.faults(hand.margins.singular_value_m) == []
    assert judgement.tip_error_m < 5e-5
    # The hand as it touches has its tips on the contacts.
    pose = posture.transform_palm_to_world
    tips = touching(hand, posture, normals).tip_positions(posture.joints)[list(posture.fingers)]
    np.testing.assert_allclose(tips @ pose[:3, :3].T + pose[:3, 3], points, atol=1e-5)


def test_planted_faults_are_seen(parameters, ball):
    hand = load_hand(parameters)
    checker = GraspChecker(hand)
    points, normals = contacts(0)
    posture = checker.place(points, normals)
    off = points.copy()
    off[0] -= 2e-4 * normals[0]
    found = verify_posture(hand, posture, off, normals)
    assert any("0.2" in clause and "from its contact" in clause for clause in found), found
    deep = points.copy()
    deep[1] += 3e-4 * normals[1]
    found = verify_posture(hand, posture, deep, normals)
    assert any("behind its contact's plane" in clause for clause in found)
    tilted = normals.copy()
    tilted[2] += 0.9 * np.array([0.0, 0.0, 1.0])
    tilted[2] /= np.linalg.norm(tilted[2])
    either = ["behind its contact's plane" in c for c in verify_posture(hand, posture, points, tilted)]
    tilted[2] = normals[2] - 0.9 * np.array([0.0, 0.0, 1.0])
    tilted[2] /= np.linalg.norm(tilted[2])
    either += ["behind its contact's plane" in c for c in verify_posture(hand, posture, points, tilted)]
    assert any(either)
    judgement = judge(parameters, hand, posture, off, normals, None)
    assert "tip error" in judgement.faults(hand.margins.singular_value_m)


@compiled
def rows_of(chains, shapes, task, contact_of, pose, joints, system, rows, gaps):
    place_hand(chains, shapes, joints, system.frames, system.tips, system.poses)
    count = collect_tips(chains, task, contact_of, pose, system)
    rows[:] = 0.0
    for r in range(count):
        _tip_row(chains, system, r, joints.shape[1], rows[r])
        gaps[r] = system.gaps[r, 0]


def test_the_gaps_derivatives_are_those_of_finite_differences(parameters):
    """By the wrist's twist and by the joints, also where the touching point moves as the link turns."""
    hand = load_hand(parameters)
    points, normals = contacts(1)
    limits = np.array([-np.inf, 0.0, 0.0, 0.0, 0.016, 3e-4])
    assert limits[SHARPNESS] == 3e-4
    task = Task(points, points, normals, make_obstacle(np.zeros((0, 3))), limits)
    system = make_system(hand.chains, hand.shapes)
    contact_of = np.arange(3)
    n, k = hand.chains.index.shape
    rng = np.random.default_rng(2)
    pose = np.column_stack((trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3], CENTRE))
    joints = hand.by_finger(hand.preferred) + rng.normal(0, 0.1, (n, k))

    def evaluate(pose, joints):
        rows, gaps = np.zeros((9, 6 + n * k)), np.zeros(9)
        rows_of(
            hand.chains, hand.shapes, task, contact_of, np.ascontiguousarray(pose), joints, system, rows, gaps
        )
        return rows, gaps

    rows, _ = evaluate(pose, joints)
    step = 1e-7
    for i in range(6 + n * k):
        ends = []
        for sign in (1.0, -1.0):
            moved, turned = pose.copy(), joints.copy()
            if i < 3:
                moved[:, 3] += sign * step * pose[:, i]
            elif i < 6:
                turn = trimesh.transformations.rotation_matrix(sign * step, np.eye(3)[i - 3])[:3, :3]
                moved[:, :3] = pose[:, :3] @ turn
            else:
                turned.ravel()[i - 6] += sign * step
            ends.append(evaluate(moved, turned)[1])
        np.testing.assert_allclose(rows[:, i], (ends[0] - ends[1]) / (2 * step), atol=2e-6)


def test_hands_that_cannot_touch_with_links_are_refused(tmp_path):
    with pytest.raises(HandError, match="tips of the radial hand"):
        load_hand(HandParameters(tip_shape="link"))
    bare = tip_hand(tmp_path, BOX)
    path = tmp_path / "hand.urdf"
    text = path.read_text()
    start = text.index("<collision", text.index('name="g_d"'))
    end = text.index("</collision>", start) + len("</collision>")
    path.write_text(text[:start] + text[end:])
    with pytest.raises(HandError, match="last link of finger 'g'"):
        load_hand(replace(bare, name="bare"))
