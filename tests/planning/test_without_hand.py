import numpy as np
import pytest

from graspbench.errors import PlanningError
from graspbench.planning import PlannerParameters, make_index
from graspbench.planning.indices.force_field import ForceFieldParameters
from graspbench.planning.indices.mirtich_canny import MirtichCannyParameters, mirtich_canny_scores
from graspbench.planning.without_hand import plan_without_hand
from tests.planning.shapes import directions, ellipsoid, surface_of

MERIDIANS, PARALLELS = 24, 17


def shrinking_trilobe():
    """An ellipsoid that becomes a body with three lobes."""
    d = directions(MERIDIANS, PARALLELS)
    lobes = 0.04 * (1 + 0.2 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2))
    return [
        surface_of(
            d * (share * 0.06 + (1 - share) * lobes)[:, None], MERIDIANS, PARALLELS, at_rest=share == 0
        )
        for share in (1.0, 0.6, 0.3, 0.0)
    ]


def test_ends_on_the_lobes_within_the_thresholds():
    surfaces = shrinking_trilobe()
    index = make_index("mirtich_canny", MirtichCannyParameters(), 3)
    plan = plan_without_hand(surfaces, index, 3, PlannerParameters(rotations=3))
    cei, eegi, area = mirtich_canny_scores(plan.grasp.points, plan.grasp.normals)
    assert cei < 15
    assert eegi < 10
    assert area > 0.9 * 3 * np.sqrt(3) * 0.048**2
    assert np.array_equal(plan.grasp.points, surfaces[-1].points[plan.grasp.vertices])
    assert np.array_equal(plan.history[0].points, surfaces[0].points[plan.history[0].vertices])
    assert plan.history[-1] is plan.grasp
    assert plan.starts == 33
    assert plan.score == index.score(surfaces[-1], plan.grasp.vertices)


def test_more_starts_are_never_worse():
    surfaces = shrinking_trilobe()
    index = make_index("mirtich_canny", MirtichCannyParameters(), 3)
    scores = [plan_without_hand(surfaces, index, 3, PlannerParameters(rotations=n)).score for n in (1, 2, 4)]
    assert scores == sorted(scores)


def test_too_few_nodes():
    surface = ellipsoid((0.01, 0.01, 0.01), meridians=3, parallels=1)
    index = make_index("force_field", ForceFieldParameters(), 6)
    with pytest.raises(PlanningError, match="too few nodes for 6 contacts"):
        plan_without_hand([surface], index, 6, PlannerParameters())
