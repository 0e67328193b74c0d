"""What a kept direction refutes is refuted: the exact ball of such a grasp is no larger than the floor."""

import numpy as np
import pytest

from graspbench.grasp.quality import QualityParameters
from graspbench.planning.search.layout import lay_out
from graspbench.planning.search.objectives import make_objective
from graspbench.planning.search.refuting import WeakDirections


def ball_of_nodes(count, quality):
    random = np.random.default_rng(5)
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = 0.03 * normals * random.uniform(0.8, 1.2, (count, 1))
    limits = np.array([np.inf, np.inf])
    return lay_out(points, -normals, np.zeros(3), quality, 0.03, np.arange(count), 3, limits)


@pytest.mark.parametrize("contact", ["hard_finger", "soft_finger"])
def test_only_grasps_with_no_larger_ball_are_refuted_and_hardly_any_of_those_stands(contact):
    layout = ball_of_nodes(60, QualityParameters(contact=contact))
    grasps = layout.sample(4000)
    exact = layout.measure(grasps, "q3", -np.inf)
    floor = float(np.quantile(exact[exact > 0], 0.7))
    weak = WeakDirections(layout.wrenches)
    refuted = np.concatenate([weak.refuted(grasps[k : k + 100], floor) for k in range(0, len(grasps), 100)])
    assert exact[refuted].max() <= floor * (1 + 1e-9)
    assert (exact > floor).any()
    assert refuted[exact <= floor].mean() > 0.95


def test_values_above_a_floor_are_what_they_are_without_it():
    layout = ball_of_nodes(40, QualityParameters())
    grasps, objective = layout.sample(3000), make_objective(layout, "q3")
    exact = layout.measure(grasps, "q3", -np.inf)
    for floor in np.quantile(exact[exact > 0], [0.5, 0.9, 0.2]):
        found = objective.evaluate(grasps, float(floor))
        above = exact > floor
        np.testing.assert_array_equal(found[above], exact[above])
        assert (found[~above] <= floor).all()
