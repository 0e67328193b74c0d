"""What follows the contact: one plan for the mount's place and for the execution."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.simulation import ExecutionParameters
from graspbench.simulation.phases import TILT_DIRECTIONS, palm_task, plan_lift, plan_phases

CARRYING = ["lift", "hold", "rotate", "hold_rotated"]
SHAKES = ["shake_x", "shake_y", "shake_z"]
OBJECT = np.array([0.05, 0.0, 0.05])


def from_the_side():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    pose[:3, 3] = [-0.14, 0.0, 0.06]
    return pose


@pytest.mark.parametrize(
    ("until", "carrying", "pushes", "shakes"),
    [
        ("off", [], False, []),
        ("contact", [], False, []),
        ("hold", CARRYING, False, []),
        ("pushes", CARRYING, True, []),
        ("shakes", CARRYING, True, SHAKES),
    ],
)
def test_until_says_which_phases_there_are(until, carrying, pushes, shakes):
    plan = plan_phases(from_the_side(), OBJECT, ExecutionParameters(until=until), 1.0)
    assert [phase.name for phase in plan.carrying] == carrying
    assert plan.pushes is pushes
    assert [phase.name for phase in plan.shakes] == shakes
    assert plan.motions == plan.carrying + plan.shakes


@pytest.mark.parametrize("direction", TILT_DIRECTIONS)
def test_each_phase_starts_where_the_one_before_ended(direction):
    palm = from_the_side()
    plan = plan_phases(palm, OBJECT, ExecutionParameters(until="shakes"), direction)
    now = palm
    for phase in plan.motions:
        np.testing.assert_allclose(phase.motion(0.0), now, atol=1e-12)
        now = phase.motion(1.0)
    approach = 2.0 * direction  # the approach direction turns up or down by a right angle
    np.testing.assert_allclose(now[:3, 2], [0.0, 0.0, 0.5 * approach], atol=1e-12)


def test_no_rotation_is_no_phase_and_a_lift_is_only_that():
    still = plan_phases(from_the_side(), OBJECT, ExecutionParameters(rotation_deg=0.0), 1.0)
    assert [phase.name for phase in still.carrying] == ["lift", "hold"]
    lift = plan_lift(from_the_side(), OBJECT, ExecutionParameters(until="shakes"), 1.0)
    assert [phase.name for phase in lift.motions] == ["lift", "hold"]


def test_the_mount_is_told_the_path_and_every_phase_after_it():
    palm, parameters = from_the_side(), ExecutionParameters(until="shakes")
    before = palm.copy()
    before[2, 3] += 0.1
    task = palm_task(np.array([0.0, 1.0]), np.stack((before, palm)), OBJECT, parameters, plan_phases)
    np.testing.assert_array_equal(task.start, before)
    np.testing.assert_array_equal(task.grasping, palm)
    assert set(task.poses) == set(TILT_DIRECTIONS)
    for direction, (poses, times) in task.poses.items():
        plan = plan_phases(palm, OBJECT, parameters, direction)
        assert times[-1] == pytest.approx(1.0 + sum(phase.time_s for phase in plan.motions))
        assert (np.diff(times) > 0.0).all()
        for phase in plan.motions:
            gaps = np.abs(poses - phase.motion(1.0)).max(axis=(1, 2))
            assert gaps.min() < 1e-12
