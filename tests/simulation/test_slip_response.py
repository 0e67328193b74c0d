"""A grip that gets firmer when it feels the object slide."""

from types import SimpleNamespace

import pytest

from graspbench.simulation.slip_response import SlipResponse
from tests.simulation.test_grasp_execution import cylinder, hand, run, tip  # noqa: F401


def test_the_grip_gets_firmer_step_by_step_up_to_its_limit():
    distributed = []
    control = SimpleNamespace(mean_force_n=4.0, distribute=lambda: distributed.append(1))
    response = SlipResponse(control, 0.5, 10.0)
    for slip_m, expected_n in (
        (5e-5, 4.0),
        (1.2e-4, 6.0),
        (1.5e-4, 6.0),
        (3e-4, 9.0),
        (9e-4, 10.0),
        (2e-3, 10.0),
    ):
        response.feel(slip_m)
        assert control.mean_force_n == pytest.approx(expected_n)
    assert len(distributed) == 3
    silent = SlipResponse(control, 0.0, 50.0)
    silent.feel(1.0)
    assert control.mean_force_n == 10.0


@pytest.mark.parametrize(("response", "holds"), [(0.0, False), (0.2, True)])
def test_an_object_heavier_than_its_grip_is_held_once_it_is_felt_to_slide(hand, response, holds):  # noqa: F811
    force, friction = 4.0, 0.5
    mass = 1.3 * 3 * friction * force / 9.81
    result = run(
        hand, cylinder(mass_kg=mass), tip(friction, 0.0), grip_force_n=force, grip_safety=0.01,
        steady_share=1.0, rotation_deg=0.0, slip_response=response,
    )  # fmt: skip
    assert result.success is holds, result.reason
    assert (result.grip_force_n > force) is holds
    if holds:
        assert result.grip_force_n >= mass * 9.81 / (3 * friction)
        assert result.phases[-1].slip_m < 0.005
