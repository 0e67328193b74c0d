"""What is believed of grasps that were not tried, against closed forms and a joint Gaussian written out."""

import numpy as np
import pytest

from graspbench.planning.grasp_optimization import GraspOptimization

DEVIATION, NOISE, LENGTH_M = 0.04, 0.01, 0.02


def optimization(foreseen, places_m):
    """Candidates of three contacts that are all shifted by so much along x."""
    base = np.array([[0.03, 0.0, 0.0], [-0.015, 0.026, 0.0], [-0.015, -0.026, 0.0]])
    contacts = np.stack([base + np.array([x, 0.0, 0.0]) for x in places_m])
    return GraspOptimization(contacts, np.array(foreseen), DEVIATION, NOISE, LENGTH_M)


def test_one_trial_tells_of_itself_and_of_its_neighbours_by_closed_form():
    belief = optimization([0.1, 0.1, 0.2], [0.0, LENGTH_M, 1.0])
    belief.tell(0, 0.06)
    mean, deviation = belief.believed()
    gain = DEVIATION**2 / (DEVIATION**2 + NOISE**2)
    share = np.exp(-0.5)
    np.testing.assert_allclose(mean, [0.1 - gain * 0.04, 0.1 - share * gain * 0.04, 0.2], atol=1e-12)
    free = DEVIATION**2 + NOISE**2
    np.testing.assert_allclose(
        deviation**2,
        [free - DEVIATION**2 * gain, free - DEVIATION**2 * share**2 * gain, free],
        rtol=1e-9,
    )


def test_many_trials_agree_with_the_joint_gaussian_written_out():
    rng = np.random.default_rng(3)
    places, foreseen = rng.uniform(0.0, 0.06, 7), rng.uniform(0.05, 0.2, 7)
    belief = optimization(foreseen, places)
    felt = {4: 0.11, 1: 0.02, 6: 0.19}
    for number, value in felt.items():
        belief.tell(number, value)
    joint = np.empty((10, 10))  # of the seven to come and the three that were
    of = [*range(7), *felt]
    for i in range(10):
        for j in range(10):
            apart = places[of[i]] - places[of[j]]
            joint[i, j] = DEVIATION**2 * np.exp(-0.5 * (apart / LENGTH_M) ** 2) + (i == j) * NOISE**2
    gain = joint[:7, 7:] @ np.linalg.inv(joint[7:, 7:])
    mean, deviation = belief.believed()
    wanted = foreseen + gain @ (np.array(list(felt.values())) - foreseen[list(felt)])
    np.testing.assert_allclose(mean, wanted, atol=1e-12)
    np.testing.assert_allclose(deviation**2, np.diag(joint[:7, :7] - gain @ joint[7:, :7]), rtol=1e-6)


def test_the_expected_improvement_is_that_of_a_million_draws():
    belief = optimization([0.10, 0.11, 0.12], [0.0, 0.5, 1.0])
    belief.tell(0, 0.115)
    found = belief.choose()
    assert found is not None
    assert found.number == 2
    mean, deviation = belief.believed()
    drawn = np.random.default_rng(0).normal(mean[2], deviation[2], 1_000_000)
    assert found.improvement == pytest.approx(np.maximum(drawn - 0.115, 0.0).mean(), rel=5e-3)


def test_a_disappointment_leads_away_from_where_it_was_felt():
    # The neighbour is foreseen to be better than the one far off, until the first of them disappoints.
    belief = optimization([0.20, 0.19, 0.17], [0.0, 0.004, 0.5])
    first = belief.choose()
    assert first is not None
    assert first.number == 0
    belief.tell(0, 0.05)
    second = belief.choose()
    assert second is not None
    assert second.number == 2


def test_when_all_were_tried_nothing_is_chosen():
    belief = optimization([0.1], [0.0])
    belief.tell(0, 0.1)
    assert belief.choose() is None
