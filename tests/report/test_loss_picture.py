"""The picture of a lost object: its moments, and that object and contacts are where they were then."""

import cv2
import numpy as np
import pytest
import trimesh

from graspbench.hand import HandParameters, load_hand
from graspbench.report import style
from graspbench.report.loss_picture import draw_loss, loss_moments, object_drift
from graspbench.simulation.execution_result import Motion

STEP_S = 0.02


def motion(drop_at=None, count=100, joints=12):
    """Return a motion that lifts the palm; the object falls out of it from a sample on."""
    palms, objects = np.tile(np.eye(4), (2, count, 1, 1))
    palms[:, :3, :3] = np.diag([1.0, -1.0, -1.0])
    palms[:, 2, 3] = 0.25 + np.linspace(0.0, 0.2, count)
    objects[:, 2, 3] = 0.1 + np.linspace(0.0, 0.2, count)
    if drop_at is not None:
        objects[drop_at:, 2, 3] -= 0.5 * 9.81 * (STEP_S * np.arange(count - drop_at)) ** 2
    return Motion(STEP_S * np.arange(count), np.zeros((count, joints)), palms, objects)


def test_moments_follow_the_fall():
    seen = motion(drop_at=50)
    moments = loss_moments(seen, (0.2, 0.4, np.nan))
    assert [m.sample for m in moments] == [20, 51, 54, 99]
    drift = object_drift(seen, 20)
    assert drift[51] <= 0.002 < drift[52]
    assert drift[53] <= 0.02 < drift[54]


def test_object_that_stays_in_the_hand_has_two_moments():
    assert [m.sample for m in loss_moments(motion(), (0.2, 0.4, 0.3))] == [20, 99]


@pytest.mark.parametrize("times", [(), (np.nan, np.nan), (50.0,)])
def test_fingers_that_never_touch_leave_the_end(times):
    assert [m.sample for m in loss_moments(motion(), times)] == [99]


def test_object_falls_out_of_the_picture_of_the_hand(tmp_path, trial):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
    hand = load_hand(HandParameters())
    seen = motion(drop_at=50, joints=hand.n_joints)
    path = draw_loss(
        ball.vertices, ball.faces, hand, trial.grasp, seen, (0.4, 0.4, 0.4), "dropped", tmp_path / "loss.png"
    )
    image = cv2.imread(str(path))[..., ::-1].astype(int)
    assert image.shape[1] == 4 * 380

    def blue(tile):
        """Count the object's pixels: it alone is much more blue than red."""
        part = image[:380, 380 * tile : 380 * (tile + 1)]
        return int((part[..., 2] - part[..., 0] > 25).sum())

    def red(tile):
        part = image[:380, 380 * tile : 380 * (tile + 1)]
        return bool((np.abs(part - 255 * np.array(style.CONTACT)).max(axis=-1) < 60).any())

    assert blue(0) > 500
    assert blue(1) == pytest.approx(blue(0), rel=0.1)
    assert blue(3) < 0.1 * blue(0)  # it fell far out of sight
    assert red(0)
    assert not red(3)
