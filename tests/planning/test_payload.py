"""What a hand can lift, against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest

from graspbench.hand.posture import HandPosture
from graspbench.planning.payload import carries, payload_n

EFFORT = 3.0


def sliding_hand(n, effort=EFFORT):
    """Return a hand whose fingers slide along the palm's axes: torques are forces."""
    jacobians = np.zeros((n, 3, 3 * n))
    for i in range(n):
        jacobians[i, :, 3 * i : 3 * i + 3] = np.eye(3)
    return SimpleNamespace(
        n_joints=3 * n,
        effort_limits=np.full(3 * n, effort),
        tips_are_links=False,
        tip_jacobians=lambda joints: jacobians,
    )


def posture(n, palm=None):
    return HandPosture(
        np.eye(4) if palm is None else palm, np.zeros(3 * n), tuple(range(n)), 0.0, 0.1, 0.01, 0.01
    )


def opposed(n=2):
    angles = 2 * np.pi * np.arange(n) / n
    out = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(n)))
    return 0.03 * out, -out


@pytest.mark.parametrize("friction", [0.2, 0.5, 0.9])
def test_two_opposed_contacts_carry_what_friction_makes_of_their_effort(friction):
    points, normals = opposed()
    carried = payload_n(sliding_hand(2), posture(2), points, normals, np.zeros(3), friction)
    assert carried == pytest.approx(2 * friction * EFFORT, rel=0.03)


def test_effort_of_the_lifting_joints_limits_too():
    points, normals = opposed()
    hand = sliding_hand(2)
    hand.effort_limits[[2, 5]] = 0.1
    carried = payload_n(hand, posture(2), points, normals, np.zeros(3), 0.5)
    assert carried == pytest.approx(0.2, rel=1e-6)


def test_palm_that_is_turned_turns_the_efforts():
    points, normals = opposed()
    hand = sliding_hand(2)
    hand.effort_limits[[0, 3]] = 0.1  # along the palm's x, which points up in the world here
    palm = np.eye(4)
    palm[:3, :3] = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    carried = payload_n(hand, posture(2, palm), points, normals, np.zeros(3), 0.5)
    assert carried == pytest.approx(0.2, rel=1e-6)


def test_contacts_that_are_not_closed_carry_nothing():
    points, normals = opposed()
    assert payload_n(sliding_hand(2), posture(2), points, normals[[0, 0]], np.zeros(3), 0.5) < 1e-9


def test_an_object_between_two_contacts_may_swing_until_it_hangs():
    points, normals = opposed()
    beside = np.array([0.0, 0.004, 0.0])
    carried = payload_n(sliding_hand(2), posture(2), points, normals, beside, 0.5)
    assert carried == pytest.approx(2 * 0.5 * EFFORT, rel=0.03)
    along = np.array([0.06, 0.0, 0.0])  # beyond a contact: no swing helps
    assert payload_n(sliding_hand(2), posture(2), points, normals, along, 0.5) < carried - 0.1


def test_soft_fingers_carry_what_hangs_beside_a_line_of_three():
    points = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    given = (sliding_hand(3), posture(3), points, normals, np.array([0.0, 0.004, 0.0]), 0.5)
    assert payload_n(*given) < 1e-6
    assert payload_n(*given, 0.004) > 1.0


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("torsion_m", [0.0, 0.004])
def test_whether_a_weight_is_carried_is_what_the_largest_one_says(n, torsion_m):
    random, told = np.random.default_rng(n), []
    for _ in range(12):
        points, normals = opposed(n)
        points = points + random.normal(scale=0.004, size=points.shape)
        normals = normals + random.normal(scale=0.3, size=normals.shape)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        given = (sliding_hand(n, random.uniform(0.5, 3.0)), posture(n), points, normals, np.zeros(3), 0.5)
        most = payload_n(*given, torsion_m)
        told += [carries(*given, torsion_m, share * most) for share in (0.5, 0.999)]
        assert not carries(*given, torsion_m, 1.001 * most + 1e-6)
    assert all(told)
    assert not carries(*given[:3], normals[[0] * n], *given[4:], torsion_m, 1.0)
