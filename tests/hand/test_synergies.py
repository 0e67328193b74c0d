"""Postural synergies and the probe of a hand that holds nothing."""

import numpy as np
import pytest

from graspbench.hand import load_hand
from graspbench.hand.parameters import HandParameters
from graspbench.hand.probe import HandProbe
from graspbench.hand.synergies import ball_postures, synergies


@pytest.fixture(scope="module")
def hand():
    return load_hand(HandParameters())


def test_ball_postures_put_all_tips_on_one_ball(hand):
    for joints in ball_postures(hand)[::9]:
        tips = hand.tip_positions(joints)
        # Three tips are always on some ball: it is centred on the axis of this symmetric hand.
        spread = np.linalg.norm(tips[:, :2], axis=1)
        assert np.ptp(spread) < 2e-3
        assert np.all((joints >= hand.lower - 1e-9) & (joints <= hand.upper + 1e-9))


def test_the_first_synergy_of_a_symmetric_hand_opens_and_closes_it(hand):
    found = synergies(hand, 2)
    assert found.explained[0] > found.explained[1] > 0.0
    assert found.explained.sum() > 0.9
    widths = [
        np.linalg.norm(np.ptp(hand.tip_positions(found.joints(np.array([a, 0.0]), hand)), axis=0))
        for a in np.linspace(-1.0, 1.0, 7)
    ]
    assert np.all(np.diff(widths) > 0.0) or np.all(np.diff(widths) < 0.0)


def test_amplitudes_of_a_posture_give_it_back(hand):
    found = synergies(hand, 12)
    for joints in ball_postures(hand)[::17]:
        amplitudes = (joints - found.mean) @ np.linalg.pinv(found.directions)
        np.testing.assert_allclose(found.joints(amplitudes, hand), joints, atol=1e-6)


def test_a_hand_is_clear_far_away_and_not_inside(hand):
    corners = 0.02 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    probe, pose = HandProbe(hand, 0.0, corners, faces), np.eye(4)
    pose[2, 3] = 1.0
    assert probe.is_clear(pose, hand.preferred)
    pose[2, 3] = 0.0  # the palm around the object and through the ground
    assert not probe.is_clear(pose, hand.preferred)
    assert not HandProbe(hand, None, corners, faces).is_clear(pose, hand.preferred)
    np.testing.assert_allclose(
        probe.tips(pose, hand.preferred), hand.tip_positions(hand.preferred) + pose[:3, 3], atol=1e-12
    )
