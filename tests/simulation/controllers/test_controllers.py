"""Controllers of a held object: step responses against an oscillator's closed form, and what they hold."""

from copy import copy

import numpy as np
import pytest

from graspbench.errors import HandError
from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import HandParameters, load_hand
from graspbench.simulation import ExecutionParameters, SceneParameters, World
from graspbench.simulation.control_parameters import ComputedTorqueParameters, ObjectImpedanceParameters
from graspbench.simulation.grasp_execution import execute_grasp
from tests.simulation.test_grasp_execution import planned, tip

QUICK = {"lift_height_m": 0.05, "lift_time_s": 0.4, "hold_time_s": 0.1, "rotation_deg": 0.0}


@pytest.fixture(scope="module")
def hand():
    return load_hand(HandParameters(fingers=3))


def run(hand, name, **changes):
    model = load_object(ObjectParameters(name=name))
    grasp, path = planned(hand, model)
    with World(model, SceneParameters(yaw_deg=0.0), 0) as world:
        return execute_grasp(world, hand, grasp, path, ExecutionParameters(**(QUICK | changes)), tip())


@pytest.mark.parametrize("name", ["cylinder", "sphere"])
def test_object_impedance_is_the_oscillator_it_is_told_to_be(hand, name):
    result = run(hand, name, control="object_impedance", step_m=0.003, step_force_n=0.8)
    assert result.success, result.reason
    for kind in ("goal", "force"):
        assert result.steps[kind].error < 0.03
        assert result.steps[kind].end == pytest.approx(1.0, abs=0.04)


def test_other_masses_springs_and_dampers_too(hand):
    other = ObjectImpedanceParameters(mass_kg=0.25, damping_ns_per_m=8.0, stiffness_n_per_m=600.0)
    result = run(
        hand, "cylinder", control="object_impedance", object_impedance=other, step_m=0.002, step_force_n=1.0
    )
    assert result.steps["goal"].error < 0.05
    assert result.steps["force"].error < 0.05
    # zeta = 0.33: the overshoot of the closed form, exp(-pi zeta / sqrt(1 - zeta^2))
    zeta = 8.0 / (2.0 * np.sqrt(0.25 * 600.0))
    overshoot = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2))
    assert result.steps["goal"].overshoot == pytest.approx(overshoot, abs=0.05)


def test_without_the_observer_contact_friction_holds_the_object_back(hand):
    blind = ObjectImpedanceParameters(observer_time_s=0.0)
    result = run(hand, "cylinder", control="object_impedance", object_impedance=blind, step_m=0.003)
    assert result.steps["goal"].error > 0.07
    assert result.steps["goal"].end < 0.95


def test_computed_torque_dies_out_as_its_bandwidth_says_and_its_integral_beats_friction(hand):
    ends = {}
    for rate_hz in (0.0, 10.0):
        gains = ComputedTorqueParameters(bandwidth_rad_s=30.0, damping_ratio=1.0, integral_rate_hz=rate_hz)
        result = run(hand, "cylinder", control="computed_torque", computed_torque=gains, step_m=0.005)
        assert result.success, result.reason
        ends[rate_hz] = result.steps["goal"].end
    # 63 % of a critically damped step is reached at 2.15 / w; friction holds it back without an integral
    assert result.steps["goal"].rise_time_s == pytest.approx(2.15 / 30.0, rel=0.25)
    assert 0.7 < ends[0.0] < 0.95
    assert ends[10.0] > ends[0.0] + 0.1


@pytest.mark.parametrize("control", ["object_impedance", "computed_torque", "hybrid"])
def test_each_holds_the_object_through_lift_tilt_and_pushes_and_undoes_these(hand, control):
    result = run(hand, "cylinder", control=control, until="pushes", rotation_deg=90.0, push_time_s=0.2)
    assert result.success, result.reason
    assert all(phase.contacts == 3 for phase in result.phases)
    assert result.phases[-1].drift_m < 0.002
    assert min(result.pushes_weight) > 0.5
    again = run(hand, "cylinder", control=control, until="pushes", rotation_deg=90.0, push_time_s=0.2)
    assert again.pushes_weight == result.pushes_weight


def test_a_goal_step_moves_the_object_under_every_controller(hand):
    for control in ("joint_impedance", "hybrid"):
        result = run(hand, "cylinder", control=control, step_m=0.003, step_force_n=0.5)
        assert result.steps["goal"].error is None
        assert result.steps["goal"].end == pytest.approx(1.0, abs=0.35)
        assert 0.0 < result.steps["force"].end < 10.0


def test_steps_are_undone(hand):
    with_steps = run(hand, "cylinder", control="object_impedance", until="pushes", step_m=0.003)
    without = run(hand, "cylinder", control="object_impedance", until="pushes")
    assert with_steps.pushes_weight == without.pushes_weight


def test_fingers_that_cannot_place_a_contact_are_refused(hand):
    two = copy(hand)  # loaded hands are shared by all who ask for them
    object.__setattr__(two, "freedom", np.array([2, 3, 3]))
    model = load_object(ObjectParameters(name="cylinder"))
    grasp, path = planned(hand, model)
    with (
        World(model, SceneParameters(yaw_deg=0.0), 0) as world,
        pytest.raises(HandError, match="joint_impedance"),
    ):
        execute_grasp(
            world, two, grasp, path, ExecutionParameters(control="object_impedance", **QUICK), tip()
        )
