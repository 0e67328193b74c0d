"""A gait starts from the planned grasp, or from another one that the hand holds."""

import dataclasses

import pytest

from graspbench.config.trial_config import load_one_config
from graspbench.errors import ManipulationError
from graspbench.manipulation import check_gait, gait_object
from graspbench.trial import gait_start
from graspbench.trial.clock import StageClock
from graspbench.trial.gait_start import gait_with_start
from graspbench.trial.planned import planned_trial
from graspbench.trial.strengthening import measured_on_surface
from tests.small import SMALL_PICTURES

GAIT = (
    "object=sphere", "hand.fingers=4", "motion=gait", "motion.gait.angle_deg=30", "clik.step_s=0.005",
    "surface.meridians=14", "surface.parallels=13", "motion.gait.starts=3", *SMALL_PICTURES,
)  # fmt: skip


@pytest.fixture(scope="module")
def planned():
    config = load_one_config(GAIT, None, "manipulate")
    with planned_trial(config, StageClock()) as trial:
        contact = dataclasses.replace(config.contact, mass_kg=trial.scene.model.mass_kg)
        yield config, trial, contact


def refusing(monkeypatch, refuses, turned_deg=lambda: 5.0):
    """Let grasps have no gait; return those that were tried."""
    tried = []

    def gait(hand, grasp, *more, **options):
        tried.append(grasp)
        if refuses(grasp):
            raise ManipulationError("the fingers can turn the object only so far", turned_deg=turned_deg())
        return gait_object(hand, grasp, *more, **options)

    monkeypatch.setattr(gait_start, "gait_object", gait)
    return tried


def test_a_planned_grasp_with_a_gait_stays(planned, monkeypatch):
    tried = refusing(monkeypatch, lambda grasp: False)
    trial, _ = gait_with_start(*planned)
    assert trial is planned[1]
    assert len(tried) == 1


def test_another_grasp_is_taken_where_the_planned_one_has_none(planned, monkeypatch):
    config, before, contact = planned
    refusing(monkeypatch, lambda grasp: grasp is before.plan.grasp)
    trial, gait = gait_with_start(*planned)
    assert trial.plan is before.plan  # what the planner found stays what it is
    assert trial.strengthened.for_gait
    assert trial.executed.grasp is not trial.plan.grasp
    found = check_gait(trial.hand, trial.surfaces[-1], gait, contact, gravity=config.scene.gravity)
    assert found.violations == ()
    assert found.turned_deg == pytest.approx(30.0, abs=0.1)


def test_the_best_by_q3_come_first_and_of_all_refusals_the_farthest_is_told(planned, monkeypatch):
    degrees = iter((4.0, 1.0, 9.0, 2.0))
    tried = refusing(monkeypatch, lambda grasp: True, lambda: next(degrees))
    with pytest.raises(ManipulationError, match="by the best of 4 grasps") as caught:
        gait_with_start(*planned)
    assert caught.value.data["turned_deg"] == 9.0
    config, trial, _ = planned
    q3 = [measured_on_surface(config, trial, grasp).q3 for grasp in tried[1:]]
    assert q3 == sorted(q3, reverse=True)
    assert all(grasp.posture is not None for grasp in tried)


def test_none_is_tried_where_none_may_be(planned, monkeypatch):
    config, trial, contact = planned
    motion = dataclasses.replace(config.motion, gait=dataclasses.replace(config.motion.gait, starts=0))
    tried = refusing(monkeypatch, lambda grasp: True)
    with pytest.raises(ManipulationError, match=r"only so far\.$"):
        gait_with_start(dataclasses.replace(config, motion=motion), trial, contact)
    assert len(tried) == 1


def test_what_no_other_grasp_could_mend_is_said_at_once(planned):
    config, trial, contact = planned
    frictionless = dataclasses.replace(contact, kind="frictionless")
    with pytest.raises(ManipulationError, match="do not gait on contacts of kind"):
        gait_with_start(config, trial, frictionless)
