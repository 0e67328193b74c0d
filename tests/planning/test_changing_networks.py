"""Planning on surfaces whose network changes from one to the next, and has holes."""

import numpy as np
import pytest

from graspbench.grasp.quality import QualityParameters
from graspbench.planning.index import make_index
from graspbench.planning.indices.force_field import ForceFieldParameters
from graspbench.planning.local import plan_local, plan_restarted
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.without_hand import plan_without_hand
from graspbench.reconstruction import SurfaceParameters, reconstruct
from tests.oracles.scenes import scene

QUALITY = QualityParameters()
INDEX = make_index("force_field", ForceFieldParameters(), 3)


@pytest.fixture(scope="module")
def surfaces():
    parameters = SurfaceParameters(method="hull_net", nodes=102, cell_px=2.5)
    return list(reconstruct(scene("torus").silhouettes, parameters))


def assert_on_surfaces(history, surfaces):
    for grasp in history:
        assert any(
            grasp.vertices.max() < len(s.points) and np.array_equal(s.points[grasp.vertices], grasp.points)
            for s in surfaces
        )
    assert np.array_equal(surfaces[-1].points[history[-1].vertices], history[-1].points)


@pytest.mark.parametrize("options", [{"followers": 1}, {"followers": 8}, {"select": "first"}])
def test_grasps_follow_from_network_to_network(options, surfaces):
    plan = plan_local(iter(surfaces), INDEX, None, 3, PlannerParameters(**options), QUALITY)
    assert plan.quality.q3 > 0.0
    assert plan.iterations == len(surfaces)
    assert_on_surfaces(plan.history, surfaces)
    formed = [step.formed for step in plan.steps]
    assert (formed[0], formed[-1]) == (0.0, 1.0)
    assert min(formed[1:]) > 0.9
    assert 0.0 <= plan.followed_share <= 1.0
    assert plan.polish_mm < 60.0
    assert len({grasp.vertices.tobytes() for grasp in plan.history}) > 1


def test_searches_on_the_finished_surface_begin_on_the_first(surfaces):
    plan = plan_restarted(surfaces, INDEX, None, 3, PlannerParameters(), QUALITY)
    assert plan.quality.q3 > 0.0
    assert_on_surfaces(plan.history, surfaces)
    free = plan_without_hand(surfaces, INDEX, 3, PlannerParameters(rotations=2))
    assert_on_surfaces(free.history, surfaces)
