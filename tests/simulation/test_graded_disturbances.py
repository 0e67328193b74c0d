"""A grasp disturbed until it slips, against Coulomb's law."""

import numpy as np
import pytest

from graspbench.hand import HandParameters, load_hand
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.graded_disturbances import FORCE_DIRECTIONS, execute_graded, quick
from tests.simulation.test_grasp_execution import cylinder, planned, tip


@pytest.fixture(scope="module")
def hand():
    return load_hand(HandParameters(fingers=3))


def graded(hand, friction):
    model = cylinder()
    grasp, path = planned(hand, model)
    parameters = quick(ExecutionParameters(grip_force_n=0.01))
    with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
        return execute_graded(world, hand, grasp, path, parameters, friction, lever_m=0.03)


def test_what_is_resisted_along_the_fingers_tangents_is_what_coulomb_allows(hand):
    # The normal forces add up to what carries four weights: one is the object's own.
    found = graded(hand, tip(0.5))
    assert found.held
    assert found.grip_force_n * 3 * 0.5 == pytest.approx(4.0 * cylinder().mass_kg * 9.81, rel=0.05)
    up, down = found.forces_weight[4], found.forces_weight[5]
    # Down, three weights are left; up, five. The fingers' springs give way and grip harder or looser by it.
    assert down == pytest.approx(3.0, abs=0.6)
    assert up >= 5.0 - 0.2
    assert len(found.forces_weight) == len(FORCE_DIRECTIONS) == 14
    np.testing.assert_allclose(np.linalg.norm(FORCE_DIRECTIONS, axis=1), 1.0)
    assert np.all(found.torques_weight > 0.0)


def test_what_is_not_held_resists_nothing(hand):
    found = graded(hand, tip(0.01))
    assert not found.held
    assert found.reason
    assert not found.forces_weight.any()
    assert not found.torques_weight.any()
