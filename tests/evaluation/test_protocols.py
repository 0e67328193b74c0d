"""The protocols in physics: a firm grasp, a grasp of nothing, and what forces do."""

from dataclasses import replace

import numpy as np
import pytest

from graspbench.evaluation.judge import Judge
from graspbench.evaluation.protocols.protocol import PROTOCOLS, stages_of
from graspbench.evaluation.protocols.resist import Resist, force_directions
from graspbench.simulation.hold_stand import HoldStand
from tests.evaluation.test_judge import above_ball, ball, radial

NEVER = lambda drift: False  # noqa: E731


@pytest.fixture(scope="module")
def stage():
    hand, model = radial(), ball()
    record = above_ball(hand)
    judgement = Judge(hand, model).judge([record])[0]
    with HoldStand(hand, model) as stand:
        yield stand, record, judgement


@pytest.mark.parametrize("name", PROTOCOLS.names())
def test_a_firm_grasp_is_a_success_and_a_grasp_of_nothing_is_none(name, stage):
    stand, record, judgement = stage
    protocol = PROTOCOLS[name]()  # as it comes
    outcome = protocol.run(stand, record, judgement, 0)
    assert outcome.success, outcome.reason
    assert outcome.reason is None
    missed = above_ball(stand.hand, height=0.5)
    judged = Judge(stand.hand, stand.object_model).judge([missed])[0]
    outcome = protocol.run(stand, missed, judged, 0)
    assert not outcome.success
    assert outcome.reason
    assert outcome.value == 0.0


def test_the_same_grasp_has_the_same_outcome_whatever_came_before(stage):
    stand, record, judgement = stage
    protocol = PROTOCOLS["six_forces"]()
    first = protocol.run(stand, record, judgement, 0)
    PROTOCOLS["shake"]().run(stand, record, judgement, 0)
    again = protocol.run(stand, record, judgement, 0)
    assert first.success == again.success
    assert first.details["closing_moved_m"] == pytest.approx(again.details["closing_moved_m"], abs=1e-4)


def test_a_free_object_falls_as_newton_says(stage):
    stand, _record, _judgement = stage
    missed = above_ball(stand.hand, height=0.5)
    judged = Judge(stand.hand, stand.object_model).judge([missed])[0]
    stand.grasp(stages_of(missed, judged), 0.2, 0.6)
    force, time_s = np.array([0.0, 0.0, 0.1]), 0.3
    drift = stand.hold(force, time_s, NEVER)
    assert drift.moved_m == pytest.approx(0.5 * (0.1 / 0.2) * time_s**2, rel=0.02)
    stand.restore()
    assert stand.drift().moved_m == pytest.approx(0.0, abs=1e-9)


def test_a_hard_tug_and_a_hard_shake_lose_the_object(stage):
    stand, record, judgement = stage
    tug = PROTOCOLS["tug"](tug_weight=50.0).run(stand, record, judgement, 0)
    assert not tug.success
    assert 0.0 < tug.value < 50.0
    shake = PROTOCOLS["shake"](frequency_hz=12.0).run(stand, record, judgement, 0)
    assert not shake.success
    assert "shake along" in shake.reason


def test_a_force_that_no_friction_holds_takes_the_object_away(stage):
    stand, record, judgement = stage
    protocol = PROTOCOLS["six_forces"]
    held = protocol().run(stand, record, judgement, 0)
    torn = protocol(force_weight=200.0).run(stand, record, judgement, 0)
    assert held.success
    assert not torn.success
    assert "lost under a force along" in torn.reason


def test_more_friction_resists_more(stage):
    stand, record, judgement = stage
    quick = {"ramp_time_s": 0.3}
    slippery = Resist(friction=0.15, **quick).run(stand, record, judgement, 0)
    rough = Resist(friction=1.0, **quick).run(stand, record, judgement, 0)
    assert rough.details["force_mean_weight"] > 1.3 * slippery.details["force_mean_weight"]
    assert rough.details["torque_mean_nm"] > slippery.details["torque_mean_nm"]
    assert rough.value >= slippery.value


def test_one_of_six_refuses_a_hand_in_the_object(stage):
    stand, record, judgement = stage
    outcome = PROTOCOLS["one_of_six"]().run(stand, record, replace(judgement, depth_m=0.004), 0)
    assert not outcome.success
    assert "4.0 mm in the object" in outcome.reason


def test_directions_of_forces_are_26_and_balanced():
    directions = force_directions()
    assert directions.shape == (26, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    np.testing.assert_allclose(directions.sum(axis=0), 0.0, atol=1e-12)
