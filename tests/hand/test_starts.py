"""Closed-form starts against a brute-force fit."""

from itertools import permutations

import numpy as np

from graspbench.hand.starts import approach_directions, rank_starts


def ring(radius, count, height=0.05):
    angle = 0.4 + 2 * np.pi * np.arange(count) / count
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return radius * normals + (0.1, -0.2, height), normals


def test_a_displaced_copy_of_the_tips_is_fitted_exactly():
    rng = np.random.default_rng(1)
    tips = rng.uniform((-0.05, -0.05, 0.05), (0.05, 0.05, 0.15), (4, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn[:, 0] *= np.linalg.det(turn)
    order = np.array([2, 0, 3, 1])
    shift = np.array([0.3, 0.1, 0.5])
    targets = tips[order] @ turn.T + shift
    poses, fingers = rank_starts(
        np.stack([np.eye(3)[0], turn[:, 2]]),
        targets,
        np.array(list(permutations(range(4)))),
        tips,
        -np.inf,
        4,
    )
    np.testing.assert_allclose(poses[0], np.column_stack([turn, shift]), atol=1e-9)
    np.testing.assert_array_equal(fingers[0], order)


def test_no_other_turn_fits_better():
    rng = np.random.default_rng(2)
    tips, targets = rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    down = np.array([[0.0, 0.0, -1.0]])
    poses, fingers = rank_starts(down, targets, np.array([[0, 1, 2]]), tips, -np.inf, 1)

    def misfit(pose):
        return np.sum((tips[fingers[0]] @ pose[:, :3].T + pose[:, 3] - targets) ** 2)

    best = misfit(poses[0])
    for angle in np.linspace(-np.pi, np.pi, 181):
        c, s = np.cos(angle), np.sin(angle)
        turn = poses[0][:, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        shift = targets.mean(axis=0) - turn @ tips.mean(axis=0)
        assert misfit(np.column_stack([turn, shift])) >= best - 1e-12


def test_directions_are_unit_distinct_and_from_above_over_a_ground():
    points, normals = ring(0.04, 3)
    directions = approach_directions(points, normals, grounded=True)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.all(directions[:, 2] < 0.36)
    cosines = directions @ directions.T - np.eye(len(directions))
    assert cosines.max() < 0.99
    assert len(approach_directions(points, normals, grounded=False)) > len(directions)


def test_two_contacts_have_directions_as_well():
    points, normals = ring(0.04, 2)
    assert len(approach_directions(points, normals, grounded=True)) >= 15


def test_a_palm_in_the_ground_comes_last():
    points, _ = ring(0.04, 3, height=0.02)
    tips, _ = ring(0.05, 3, height=0.1)
    poses, _ = rank_starts(
        np.array([[0, 0, 1.0], [0, 0, -1.0]]), points, np.array(list(permutations(range(3)))), tips, 0.0, 4
    )
    assert poses[0][2, 3] > 0.0
    assert poses[-1][2, 3] < 0.0
