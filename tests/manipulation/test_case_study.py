from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from graspbench.errors import ConfigurationError
from graspbench.manipulation.case_study import (
    CaseStudyParameters,
    case_study_path,
    case_study_system,
    run_case_study,
)

STEP = 5e-3


def parameters(**given):
    default = CaseStudyParameters()
    return replace(default, clik=replace(default.clik, step_s=STEP, integrator="heun", **given))


@pytest.fixture(scope="module")
def results():
    return {tasks: run_case_study(tasks, parameters()) for tasks in (True, False)}


def test_counts_are_those_of_the_thesis(results):
    for result in results.values():
        summary = result.summary()
        assert summary["variables"] == 20
        assert summary["closed_chain_constraints"] == 9
        assert summary["degrees_of_freedom"] == 11
        assert summary["force_closure"]
        assert summary["determinate"]
        assert summary["redundant"]


def test_start_is_that_of_the_thesis():
    system, joints, variables = case_study_system(CaseStudyParameters())
    state = system.state(joints, variables)
    tips = state.tip_positions
    assert tips[2, 0] == pytest.approx(tips[3, 0])
    assert np.linalg.norm(tips[0] - tips[2]) == pytest.approx(0.7)
    assert np.linalg.norm(tips[1] - tips[3]) == pytest.approx(1.2)
    assert tips[0, 1] == pytest.approx(tips[2, 1])
    assert joints[2] == 1.5  # close to pi / 2
    np.testing.assert_allclose(state.object_positions, 0.0, atol=1e-12)


def test_tasks_keep_what_is_lost_without_them(results):
    with_tasks, without = results[True].summary(), results[False].summary()
    assert with_tasks["q3_max_rad"] <= np.pi / 2
    assert without["q3_max_rad"] > np.pi / 2 + 0.3
    assert with_tasks["distance_13_min_m"] >= 0.3
    assert without["distance_13_min_m"] < 0.0
    assert with_tasks["midpoint_distance_after_first_pause_max_m"] <= 0.25
    assert without["midpoint_distance_max_m"] > 0.6


def test_pose_error_is_the_same_and_that_of_a_held_reference(results):
    a, b = results[True], results[False]
    moving = b.pose_error > 1e-6
    assert moving.mean() > 0.8
    relative = np.abs(a.pose_error - b.pose_error) / np.maximum(b.pose_error, 1e-12)
    # Heun's own error at this coarse period is what differs
    assert np.quantile(relative[moving], 0.99) < 0.05
    # a reference held over each period lags by half of it; Heun's rule stretches that by 1 / (1 - K dt / 2)
    lag = 0.5 * STEP / (1.0 - 0.5 * 100.0 * STEP)
    speed = np.linalg.norm(np.gradient(b.desired_positions, STEP, axis=0), axis=1)
    middle = len(speed) // 8  # mid of the first segment, where the speed hardly changes
    assert b.pose_error[middle] == pytest.approx(speed[middle] * lag, rel=0.01)


def test_pose_error_and_residual_at_one_kilohertz():
    """A tenth of the path in a tenth of the time: the same speeds, higher accelerations."""
    default = CaseStudyParameters()
    quick = replace(default, pause_s=0.1, segment_s=1.0, line_m=(-0.09, -0.04), chord_m=(-0.09, -0.01))
    for integrator, bound in (("euler", 1e-5), ("rk4", 1e-6)):
        clik = replace(default.clik, integrator=integrator)
        result = run_case_study(True, replace(quick, clik=clik))
        assert result.pose_error.max() <= 1e-4
        assert result.closed_chain_residual_m.max() <= bound


def test_joint_velocities_are_continuous(results):
    """No jump: the acceleration is that of a smooth motion, at this and at half the period."""
    for result in results.values():
        jumps = np.abs(np.diff(result.joint_velocities, axis=0)).max()
        assert jumps < 0.05
    finer = replace(parameters(), clik=replace(parameters().clik, step_s=STEP / 2), segment_s=3.0)
    coarse = replace(parameters(), segment_s=3.0)
    largest = [
        np.abs(np.diff(run_case_study(True, p).joint_velocities, axis=0)).max() for p in (coarse, finer)
    ]
    assert largest[1] < 0.6 * largest[0]


def test_path_passes_its_points_from_rest_to_rest():
    p = CaseStudyParameters()
    path = case_study_path(p)
    assert path.duration_s == pytest.approx(44.0)
    second = np.array([*p.line_m, 0.0])
    third = second + np.array([*p.chord_m, 0.0])
    for time, point in ((0.5, np.zeros(3)), (11.5, second), (22.5, third), (33.5, second), (44.0, third)):
        sample = path(time)
        np.testing.assert_allclose(sample.position, point, atol=1e-12)
        np.testing.assert_array_equal(sample.twist, 0.0)


def test_settings_in_the_configuration_are_the_defaults():
    conf = Path(__file__).parents[2] / "conf" / "clik" / "tasks" / "case_study.yaml"
    given = yaml.safe_load(conf.read_text())
    default = CaseStudyParameters().clik.tasks
    assert {k: {n: _plain(v) for n, v in values.items()} for k, values in default.items()} == given


def _plain(value):
    return list(value) if isinstance(value, tuple) else value


def test_unreachable_starts_are_refused():
    with pytest.raises(ConfigurationError, match="arm of a gripper cannot reach"):
        run_case_study(True, CaseStudyParameters(bases_m=((-9.0, 0.0), (0.8, -1.7))))
