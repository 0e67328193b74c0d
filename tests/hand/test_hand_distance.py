"""Distances of cores against Coal."""

import coal
import numpy as np
import pytest

from graspbench.hand.distance import BOX, CYLINDER, SEGMENT, core_distance


def random_pose(rng, spread):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn[:, 0] *= np.sign(np.linalg.det(turn))
    direction = rng.normal(size=3)
    return np.column_stack([turn, direction / np.linalg.norm(direction) * rng.uniform(0, spread)])


def random_core(rng, kind):
    half = rng.uniform(0.005, 0.05, 3)
    if kind == SEGMENT:
        half[:2] = 0.0
    if kind == CYLINDER:
        half[1] = half[0]
    return half


def coal_shape(kind, half):
    if kind == BOX:
        return coal.Box(*(2 * half))
    if kind == CYLINDER:
        return coal.Cylinder(half[0], 2 * half[2])
    return coal.Capsule(1e-9, 2 * half[2])


def coal_distance(a, pose_a, b, pose_b):
    at = [coal.Transform3s(p[:, :3].copy(), p[:, 3].copy()) for p in (pose_a, pose_b)]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return coal.distance(a, at[0], b, at[1], request, result)


@pytest.mark.parametrize("kind_b", [SEGMENT, BOX, CYLINDER])
@pytest.mark.parametrize("kind_a", [SEGMENT, BOX, CYLINDER])
def test_distance_agrees_with_coal(kind_a, kind_b):
    rng = np.random.default_rng(7)
    apart = 0
    for _ in range(150):
        half_a, half_b = random_core(rng, kind_a), random_core(rng, kind_b)
        pose_a, pose_b = random_pose(rng, 0.08), random_pose(rng, 0.08)
        expected = coal_distance(coal_shape(kind_a, half_a), pose_a, coal_shape(kind_b, half_b), pose_b)
        got = core_distance(kind_a, pose_a, half_a, kind_b, pose_b, half_b, np.inf)
        # Never more than the truth (but for Coal's own tolerance), hardly less.
        assert got[0] <= max(expected, 0.0) + 2e-6
        assert got[0] >= max(expected, 0.0) - 5e-5
        if expected > 1e-4:
            apart += 1
            gap = np.linalg.norm(np.subtract(got[1:4], got[4:7]))
            np.testing.assert_allclose(gap, expected, atol=1e-4)
    assert apart > 20


def test_enough_stops_early_with_a_true_bound():
    rng = np.random.default_rng(8)
    for _ in range(100):
        half_a, half_b = random_core(rng, BOX), random_core(rng, BOX)
        pose_a, pose_b = random_pose(rng, 0.15), random_pose(rng, 0.15)
        full = core_distance(BOX, pose_a, half_a, BOX, pose_b, half_b, np.inf)[0]
        quick = core_distance(BOX, pose_a, half_a, BOX, pose_b, half_b, 0.003)[0]
        assert quick <= full + 1e-9
        assert (quick > 0.003) == (full > 0.003)


def test_parallel_faces_and_segments_are_exact():
    pose_a, pose_b = np.eye(3, 4), np.eye(3, 4)
    pose_b[0, 3] = 0.1
    box = np.array([0.01, 0.02, 0.03])
    assert core_distance(BOX, pose_a, box, BOX, pose_b, box, np.inf)[0] == pytest.approx(0.08, abs=1e-9)
    rod = np.array([0.0, 0.0, 0.03])
    assert core_distance(SEGMENT, pose_a, rod, SEGMENT, pose_b, rod, np.inf)[0] == pytest.approx(
        0.1, abs=1e-12
    )
