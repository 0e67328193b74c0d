"""The hand as solids: where the kinematics say its fingertips are."""

import numpy as np
import pytest

from graspbench.hand import HandParameters, load_hand
from graspbench.report.hand_solids import hand_solids


def test_fingertips_are_drawn_where_the_model_has_them():
    hand = load_hand(HandParameters(fingers=4))
    palm = np.eye(4)
    palm[:3, 3] = [0.1, 0.2, 0.3]
    joints = np.array(hand.preferred)
    points = np.concatenate([solid.points for solid in hand_solids(hand, joints, palm)])
    for tip in hand.tip_positions(joints) + palm[:3, 3]:
        distance = np.linalg.norm(points - tip, axis=1).min()
        assert distance <= hand.tip_radius_m + 1e-9
    assert points[:, 2].max() - tip[2] == pytest.approx(hand.tip_radius_m, abs=1e-3)
