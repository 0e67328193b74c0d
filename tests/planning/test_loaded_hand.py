"""A hand that must also carry a weight."""

import numpy as np
import pytest

from graspbench.hand.posture import HandPosture
from graspbench.planning.loaded_hand import TOO_WEAK, LoadedHand

POINTS, NORMALS = np.zeros((2, 3)), np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
POSTURE = HandPosture(np.eye(4), np.zeros(4), (0, 1), 0.0, 0.1, 0.01, 0.01)


class Hand:
    """Holds everything, or nothing."""

    pair_limit_m = 0.2
    ground_height_m = 0.0

    def __init__(self, holds):
        self.found = POSTURE if holds else None

    def place(self, points, normals, *, start=None):
        return self.found

    def place_near(self, points, normals, near):
        return self.found

    def place_patiently(self, points, normals, near):
        return self.found

    def reason(self, points, normals):
        return "out of reach"


def loaded(wanted_n, *, holds=True):
    return LoadedHand(Hand(holds), lambda posture, points, normals, weight_n: weight_n <= 3.0, wanted_n)


@pytest.mark.parametrize(("wanted_n", "held"), [(2.9, True), (3.0, True), (3.1, False)])
def test_only_postures_that_carry_the_weight_count(wanted_n, held):
    hand = loaded(wanted_n)
    found = [
        hand.place(POINTS, NORMALS),
        hand.place_near(POINTS, NORMALS, ()),
        hand.place_patiently(POINTS, NORMALS, ()),
    ]
    assert found == [POSTURE if held else None] * 3


def test_it_says_whether_the_hand_or_the_weight_is_the_reason():
    assert loaded(5.0).reason(POINTS, NORMALS) == TOO_WEAK
    assert loaded(5.0, holds=False).reason(POINTS, NORMALS) == "out of reach"
