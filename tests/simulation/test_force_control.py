"""When the forces that carry the weight are found anew."""

import numpy as np
import pytest

from graspbench.simulation.force_control import _Carried


@pytest.mark.parametrize(
    ("turned_rad", "reachable", "serves"),
    [(0.0, 1.0, True), (0.002, 1.0, True), (0.02, 1.0, False), (0.0, 0.995, True), (0.0, 0.9, False)],
)
def test_forces_serve_until_the_object_has_turned_or_the_joints_can_do_less(turned_rad, reachable, serves):
    carried = _Carried(np.eye(3), np.array([0.0, 0.0, 1.0]), 1.0)
    upwards = np.array([np.sin(turned_rad), 0.0, np.cos(turned_rad)])
    assert carried.serves(upwards, reachable) is serves
