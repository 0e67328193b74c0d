"""The sentence that a run ends with."""

from dataclasses import replace

import pytest

from graspbench.cli.verdict import verdict
from graspbench.results.grasp_results import ExploredResult, StrengthenedResult
from graspbench.results.physical_results import PhaseResult
from tests.report.made import EXECUTED, made_result


def phases(held, slip_m=0.0004):
    return {
        name: PhaseResult(
            name=name, contacts=3, contacts_lost=0, slip_m=slip_m * k, drift_m=0.0, turn_deg=0.0,
            load_weight=1.0, held=name in held,
        )
        for k, name in enumerate(("squeeze", "lift", "hold"))
    }  # fmt: skip


@pytest.mark.parametrize(
    ("execution", "said"),
    [
        (None, "A grasp was planned; nothing was executed."),
        (
            replace(EXECUTED, phases=phases(("squeeze", "lift", "hold"))),
            "Held through squeeze, lift, hold; the contacts slid by up to 0.8 mm; "
            "it resists 2 times its weight in the weakest direction.",
        ),
        (
            replace(EXECUTED, phases=phases(("squeeze",)), success=False, reason="the object fell"),
            "Lost in the phase lift: the object fell.",
        ),
        (
            replace(EXECUTED, phases={}, success=False, reason="2 of 3 fingers touched"),
            "Lost before it was lifted: 2 of 3 fingers touched.",
        ),
        (
            replace(EXECUTED, phases={}, largest_push_weight=None),
            "Held by 3 fingers in touch.",
        ),
    ],
)
def test_it_says_whether_the_object_was_held_and_where_it_was_lost(execution, said):
    assert verdict(made_result("00000000aa", execution=execution)) == said


def test_it_says_that_another_grasp_than_the_planned_one_was_executed():
    instead = StrengthenedResult(q1=0.5, q2=1.0, q3=0.25, for_weight=False, climbed=True)
    planned = made_result("00000000aa")
    said = verdict(replace(planned, strengthened=instead))
    assert said == (
        f"{verdict(planned)} A strengthened grasp was executed, of Q3 0.25 where the planned one's is "
        f"{planned.local.q3:.2g}."
    )


def test_it_says_that_exploring_grasps_chose():
    felt = ExploredResult(
        q1=0.5, q2=1.0, q3=0.13, measure="q3", grasps=3, candidates=9, value=0.15, first=0.11,
        felt=(0.11, 0.15, 0.12),
        foreseen=(0.12, 0.13, 0.13), best=1, bound=None, ended="number", moved_mm=0.1, time_s=4.0,
    )  # fmt: skip
    planned = made_result("00000000aa")
    assert verdict(replace(planned, explored=felt)) == (
        f"{verdict(planned)} Of 3 exploring grasps the best was executed; "
        "it felt a Q3 of 0.15, the first 0.11."
    )
