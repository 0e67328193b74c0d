"""The friction of an execution follows that of the plan, unless it is set apart."""

from types import SimpleNamespace

import numpy as np
import pytest

from graspbench.grasp import QualityParameters
from graspbench.simulation import ExecutionParameters
from graspbench.simulation.tip_friction import TipFriction, tip_friction

# The farthest point from the centroid is 0.1 m away: the torque length.
SURFACE = SimpleNamespace(points=np.array([[0.1, 0, 0], [-0.05, 0, 0]]), centroid=np.zeros(3))


@pytest.mark.parametrize(
    ("execution", "quality", "soft_torsion_m", "expected"),
    [
        ({}, {"friction": 0.3}, None, TipFriction(0.3, 0.002, 0.3)),
        ({"friction": 0.8}, {"friction": 0.3}, None, TipFriction(0.8, 0.002, 0.3)),
        ({}, {"contact": "soft_finger", "torsional_friction": 0.07}, None, TipFriction(0.5, 0.007, 0.5)),
        ({"torsional_friction_m": 0.0}, {"contact": "soft_finger"}, None, TipFriction(0.5, 0.0, 0.5)),
        ({}, {"contact": "soft_finger"}, 0.005, TipFriction(0.5, 0.005, 0.5)),
        ({"torsional_friction_m": 0.001}, {}, 0.005, TipFriction(0.5, 0.001, 0.5)),
    ],
)
def test_null_follows_the_plan(execution, quality, soft_torsion_m, expected):
    found = tip_friction(
        ExecutionParameters(**execution), QualityParameters(**quality), SURFACE, soft_torsion_m
    )
    assert found.coulomb == expected.coulomb
    assert found.planned == expected.planned
    assert found.torsional_m == pytest.approx(expected.torsional_m)
