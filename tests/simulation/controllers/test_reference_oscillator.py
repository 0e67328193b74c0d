"""A body that is led to where an oscillator would be."""

import numpy as np

from graspbench.simulation.controllers.reference_oscillator import ReferenceOscillator
from graspbench.simulation.controllers.second_order import SecondOrder, step_response

MASS, DAMPING, STIFFNESS, DT = 0.5, 20.0, 400.0, 0.002


def answers(bandwidth_rad_s, friction, steps=200):
    """A force that makes 1 of offset comes at once and is told a step late; friction acts for a while."""
    oscillator = SecondOrder(MASS, DAMPING, STIFFNESS, DT)
    law = ReferenceOscillator(oscillator, bandwidth_rad_s, DT) if bandwidth_rad_s else oscillator
    force = np.array([STIFFNESS])
    x = v = 0.0
    felt, told = np.zeros(1), []
    for k in range(steps):
        counted_on = law.acceleration(np.array([x]), np.array([v]), felt)[0]
        missing = (force - felt)[0] / MASS - (friction if k < 20 else 0.0)
        felt = force
        v += DT * (counted_on + missing)
        x += DT * v
        told.append(x)
    return np.array(told), step_response(DT * np.arange(1, steps + 1), MASS, DAMPING, STIFFNESS)


def test_a_late_force_is_made_up_for():
    told, exact = answers(60.0, 0.0)
    # Within the first step the force acts as it pleases; afterwards nothing of it is left.
    np.testing.assert_allclose(told[100:], exact[100:], atol=2e-4)
    assert np.abs(told - exact).max() < 5e-3


def test_what_friction_took_comes_back_sooner_than_by_the_law_alone():
    led, exact = answers(60.0, 100.0)
    alone, _ = answers(0.0, 100.0)
    rms = [np.sqrt(np.mean((each - exact) ** 2)) for each in (led, alone)]
    assert rms[0] < 0.5 * rms[1]


def test_a_displaced_goal_and_a_return_to_before():
    law = ReferenceOscillator(SecondOrder(MASS, DAMPING, STIFFNESS, DT), 60.0, DT)
    still = np.zeros(1)
    law.acceleration(still, still, still)
    before = law.memory()
    law.displace(np.array([-1.0]))
    x, v, told = -1.0, 0.0, []
    for _ in range(200):
        v += DT * law.acceleration(np.array([x]), np.array([v]), still)[0]
        x += DT * v
        told.append(1.0 + x)
    exact = step_response(DT * np.arange(1, 201), MASS, DAMPING, STIFFNESS)
    np.testing.assert_allclose(told, exact, atol=1e-9)
    law.recall(before)
    np.testing.assert_allclose(law.acceleration(still, still, still), 0.0, atol=1e-12)
