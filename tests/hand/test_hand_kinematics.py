"""Compiled finger kinematics: inverse, limits, singular values."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares


def test_reachable_targets_are_reached(hand):
    rng = np.random.default_rng(1)
    for f in range(hand.n_fingers):
        own = hand.finger_joints(f)
        inside = hand.lower[own] + rng.uniform(0.1, 0.9, (200, 4)) * (hand.upper - hand.lower)[own]
        targets = np.array([hand.tip_positions(_with(hand, own, q))[f] for q in inside])
        solved = hand.finger_ik(f, targets, hand.preferred[own])
        reached = solved.error_m < 1e-7
        assert reached.mean() > 0.97
        for q, target, error in zip(solved.joints, targets, solved.error_m, strict=True):
            tip = hand.tip_positions(_with(hand, own, q))[f]
            np.testing.assert_allclose(np.linalg.norm(tip - target), error, atol=1e-9)
            assert np.all(q >= hand.lower[own])
            assert np.all(q <= hand.upper[own])


def test_warm_start_reaches_neighbours_nearby(radial):
    rng = np.random.default_rng(2)
    start = radial.preferred[:4]
    targets = radial.tip_positions(radial.preferred)[0] + rng.uniform(-0.005, 0.005, (100, 3))
    solved = radial.finger_ik(0, targets, start, centring=0.0)
    assert np.all(solved.error_m < 1e-8)
    assert np.abs(solved.joints - start).max() < 0.3


def test_out_of_reach_ends_at_the_nearest_point(radial):
    own = radial.finger_joints(0)
    target = np.array([0.05, 0.02, 0.30])
    solved = radial.finger_ik(0, target[None], radial.preferred[own])
    best = min(
        np.linalg.norm(
            least_squares(
                lambda q: radial.tip_positions(_with(radial, own, q))[0] - target,
                start,
                bounds=(radial.lower[own], radial.upper[own]),
            ).fun
        )
        for start in np.random.default_rng(0).uniform(radial.lower[own], radial.upper[own], (5, 4))
    )
    assert solved.error_m[0] < 1.02 * best + 1e-4
    assert best > 0.1


def test_free_motion_centres_the_joints(radial):
    rng = np.random.default_rng(3)
    own = radial.finger_joints(0)
    targets = radial.tip_positions(radial.preferred)[0] + rng.uniform(-0.01, 0.01, (50, 3))
    start = radial.preferred[own] + (0.0, -0.3, 0.5, -0.3)
    loose = radial.finger_ik(0, targets, start, centring=0.0)
    pulled = radial.finger_ik(0, targets, start, centring=0.5)
    assert np.all(pulled.error_m < 1e-8)

    def off(solved):
        return np.linalg.norm(solved.joints - radial.preferred[own], axis=1)

    assert np.all(off(pulled) < off(loose))


def test_margin_and_singular_value_are_those_of_the_solution(hand):
    own = hand.finger_joints(1)
    target = hand.tip_positions(hand.preferred)[1] + (0.004, -0.003, 0.002)
    solved = hand.finger_ik(1, target[None], hand.preferred[own])
    q = solved.joints[0]
    share = np.minimum(q - hand.lower[own], hand.upper[own] - q) / (hand.upper - hand.lower)[own]
    np.testing.assert_allclose(solved.joint_margin[0], share.min())
    jacobian = hand.tip_jacobians(_with(hand, own, q))[1][:, own]
    np.testing.assert_allclose(
        solved.smallest_singular_value[0], np.linalg.svd(jacobian, compute_uv=False)[-1], rtol=1e-6
    )


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_solutions_do_not_depend_on_their_batch(radial, seed):
    rng = np.random.default_rng(seed)
    targets = radial.tip_positions(radial.preferred)[0] + rng.uniform(-0.06, 0.06, (4, 3))
    start = radial.preferred[:4]
    together = radial.finger_ik(0, targets, start)
    alone = radial.finger_ik(0, targets[2:3], start)
    np.testing.assert_array_equal(together.joints[2], alone.joints[0])


def _with(hand, own, q):
    joints = hand.preferred.copy()
    joints[own] = q
    return joints
