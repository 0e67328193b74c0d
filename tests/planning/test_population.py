"""Grasps that follow the surface while it forms."""

import itertools

import numpy as np
import pytest

from graspbench.grasp.quality import QualityParameters
from graspbench.planning import population
from graspbench.planning.index import make_index
from graspbench.planning.indices.force_field import ForceFieldParameters
from graspbench.planning.indices.mirtich_canny import MirtichCannyParameters
from graspbench.planning.judge import Judge
from graspbench.planning.local import plan_local, plan_restarted
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.population import Population
from graspbench.planning.progress import formed_shares
from tests.planning.shapes import radial, shrinking

QUALITY = QualityParameters()


def waved(d):
    return 0.04 * (1 + 0.1 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 0])


def field(**parameters):
    return make_index("force_field", ForceFieldParameters(**parameters), 3)


def plan(surfaces, index=None, **planner):
    return plan_local(iter(surfaces), index or field(), None, 3, PlannerParameters(**planner), QUALITY)


@pytest.fixture(scope="module")
def surfaces():
    return shrinking(radial(waved), steps=8)


def test_there_is_a_best_grasp_at_every_step_and_the_followers_only_get_fewer(surfaces):
    found = plan(surfaces, followers=8)
    assert len(found.steps) == len(surfaces) == found.iterations
    followers = [step.followers for step in found.steps]
    assert followers[0] > 8 >= followers[-1]
    assert all(later <= earlier for earlier, later in itertools.pairwise(followers))
    formed = [step.formed for step in found.steps]
    assert formed[0] == 0
    assert formed[-1] == 1
    assert all(later >= earlier for earlier, later in itertools.pairwise(formed))
    assert all(len(step.quality) == 3 for step in found.steps)


def test_could_stop_after_any_surface(surfaces):
    """What is best after a step does not depend on the surfaces that come later."""
    whole = Population(Judge(field(), None, PlannerParameters(), QUALITY), 3)
    part = Population(Judge(field(), None, PlannerParameters(), QUALITY), 3)
    for surface in surfaces:
        whole.follow(surface)
    for surface in surfaces[:5]:
        part.follow(surface)
    for one, other in zip(whole.steps[:5], part.steps, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)


def test_the_grasp_comes_from_a_follower_whose_way_leads_from_the_ellipsoid(surfaces):
    found = plan(surfaces)
    assert found.found_by == "follower"
    assert 0 <= found.followed_share <= 1
    assert found.polish_mm >= 0
    np.testing.assert_array_equal(found.history[0].points, surfaces[0].points[found.initial.vertices])
    on = [min(np.abs(s.points[g.vertices] - g.points).max() for s in surfaces) for g in found.history]
    assert max(on) == 0
    seen = {id(s) for s in surfaces for g in found.history if np.all(s.points[g.vertices] == g.points)}
    assert len(seen) == len(surfaces)


def test_a_multi_start_on_the_finished_surface_says_that_it_is_one(surfaces):
    found = plan_restarted(surfaces, field(), None, 3, PlannerParameters(), QUALITY)
    assert found.found_by == "restart"
    assert found.followed_share == 0
    assert found.steps == ()


def test_what_followers_were_early_is_polished_too_and_makes_no_grasp_worse(surfaces, monkeypatch):
    with_memory = plan(surfaces)
    monkeypatch.setattr(population, "_EARLY", len(surfaces))
    without = plan(surfaces)
    assert with_memory.score >= without.score
    assert with_memory.rotations_tried == without.rotations_tried


def test_ranks_by_the_index_unless_asked_for_quality(surfaces):
    by_index, by_quality = plan(surfaces), plan(surfaces, select="quality")
    assert by_index.score >= by_quality.score - 1e-9
    assert np.prod(by_quality.quality) >= np.prod(by_index.quality) * (1 - 1e-9)


def test_more_followers_find_no_worse_a_grasp_than_one(surfaces):
    one, many = plan(surfaces, followers=1), plan(surfaces)
    assert one.steps[-1].followers == 1
    assert many.score >= one.score


def test_an_index_without_a_climb_of_its_own_follows_too(surfaces):
    index = make_index("mirtich_canny", MirtichCannyParameters(), 3)
    found = plan(surfaces, index=index, planes=2, followers=3)
    assert found.found_by == "follower"
    assert found.steps[0].followers <= 4


def test_share_formed_is_measured_on_the_nodes(surfaces):
    many = Population(Judge(field(), None, PlannerParameters(), QUALITY), 3)
    for surface in surfaces:
        many.follow(surface)
    np.testing.assert_allclose(formed_shares(many.steps), np.linspace(0, 1, len(surfaces)), atol=1e-6)
