"""Every planner that ships, by the one protocol; what they yield is checked by nothing of theirs."""

import itertools

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from graspbench.errors import PlanningError
from graspbench.grasp.contact import contact_tangents
from graspbench.grasp.distance import contact_distance_m, diversity_m
from graspbench.grasp.quality import QualityParameters
from graspbench.hand import GraspChecker, load_hand
from graspbench.hand.parameters import HandParameters
from graspbench.planning import PLANNERS, FoundGrasp, PlanningProblem, make_index, make_planner, plan_with
from graspbench.planning.anytime import NO_POSTURE
from graspbench.planning.index import INDICES
from graspbench.planning.judge import NOT_CLOSED
from graspbench.planning.on_surface import grasp_at
from tests.planning.shapes import radial, shrinking

QUALITY = QualityParameters(friction=0.6)
OPTIONS = {
    "parallel": {"planes": 2, "rotations": 2},
    "restarted": {"planes": 2, "rotations": 2},
    "global": {"gap": 0.3, "threads": 1},
    "random_closure": {"grasps": 3},
    "eigengrasp": {"grasps": 2, "steps": 400, "anneals": 6},
}


@pytest.fixture(scope="module")
def checker():
    return GraspChecker(load_hand(HandParameters()), None)


@pytest.fixture(scope="module")
def surfaces():
    body = radial(lambda d: 0.03 + 0.004 * d[:, 2] ** 2, meridians=15, parallels=15)
    return list(shrinking(body, steps=3))


def problem(surfaces, checker, **more):
    index = make_index("force_field", INDICES["force_field"].parameters(), 3, QUALITY)
    return PlanningProblem(iter(surfaces), checker, 3, index, QUALITY, **more)


def planner(name, **options):
    return make_planner(name, PLANNERS[name].parameters(**OPTIONS[name], **options))


def contains_origin(points, normals, centroid, friction):
    """Force closure by the hull of the cones' edges, wrenches built here."""
    wrenches = []
    first = contact_tangents(points, -normals, centroid)
    for point, normal, tangent in zip(points, normals, first, strict=True):
        other = np.cross(normal, tangent)
        for angle in 2 * np.pi * np.arange(8) / 8:
            force = -normal + friction * (np.cos(angle) * tangent + np.sin(angle) * other)
            wrenches.append([*force, *(np.cross(point - centroid, force) / 0.03)])
    return bool(np.all(ConvexHull(np.array(wrenches)).equations[:, -1] < -1e-9))


def test_every_planner_that_ships_is_tested_here():
    assert set(OPTIONS) == set(PLANNERS.names())


@pytest.mark.parametrize("name", OPTIONS)
def test_grasps_are_closed_and_held_by_an_independent_check(name, surfaces, checker):
    plan = plan_with(planner(name), problem(surfaces, checker))
    last = surfaces[-1]
    for timed in plan.found:
        grasp = timed.found.grasp
        assert contains_origin(grasp.points, grasp.normals, last.centroid, QUALITY.friction)
        np.testing.assert_array_equal(grasp.points, last.points[grasp.vertices])
        assert checker.verify(grasp.posture, grasp.points, grasp.normals) == ()
    assert plan.score == max(timed.found.score for timed in plan.found)
    assert 0.0 <= plan.first_s <= plan.best_s <= plan.time_s
    assert plan.history[-1] is plan.grasp


@pytest.mark.parametrize("name", ["random_closure", "eigengrasp"])
def test_the_seed_decides(name, surfaces, checker):
    def contacts(seed):
        plan = plan_with(planner(name), problem(surfaces, checker, seed=seed))
        return [timed.found.grasp.vertices.tolist() for timed in plan.found]

    assert contacts(1) == contacts(1)
    assert contacts(1) != contacts(2)


def test_the_global_planner_is_not_beaten_by_sampling(surfaces, checker):
    best = plan_with(planner("global"), problem(surfaces, checker)).quality.q3
    sampled = plan_with(planner("random_closure"), problem(surfaces, checker)).quality.q3
    assert sampled <= best / (1.0 - OPTIONS["global"]["gap"])


class Scripted:
    """Yields what it is given."""

    climbs_index = False

    def __init__(self, *yields):
        self.yields, self.asked = yields, 0

    def plan(self, problem):
        last = problem.finished_surface()
        for vertices, score, posture in self.yields:
            self.asked += 1
            grasp = grasp_at(last, np.array(vertices), None)
            if posture:
                grasp = grasp_at(last, np.array(vertices), problem.hand.place(grasp.points, grasp.normals))
            yield FoundGrasp(grasp, score)


def closed_vertices(surface):
    angles = np.radians([90.0, 210.0, 330.0])
    wanted = surface.centroid + 0.03 * np.column_stack((np.cos(angles), np.sin(angles), np.zeros(3)))
    return np.argmin(np.linalg.norm(surface.points[None] - wanted[:, None], axis=2), axis=1)


def test_what_is_no_grasp_is_refused_whatever_the_planner_says(surfaces, checker):
    good, bad = closed_vertices(surfaces[-1]), [1, 2, 3]
    scripted = Scripted((bad, 9.0, True), (good, 8.0, False), (good, 1.0, True))
    plan = plan_with(scripted, problem(surfaces, checker))
    assert plan.score == 1.0
    assert sum(plan.rejected.values()) == 2
    assert plan.rejected[NO_POSTURE] >= 1
    with pytest.raises(PlanningError, match=NOT_CLOSED):
        plan_with(Scripted((bad, 9.0, False)), problem(surfaces, None))


def test_nobody_asks_on_when_the_time_is_up(surfaces):
    good = closed_vertices(surfaces[-1])
    scripted = Scripted(*[(good, float(k), False) for k in range(1000)])
    plan = plan_with(scripted, problem(surfaces, None, time_limit_s=1e-9))
    assert scripted.asked == 1
    assert len(plan.found) == 1


def test_the_distance_of_grasps_is_that_of_the_best_matching():
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = rng.normal(size=(2, 4, 3))
        costs = [
            np.linalg.norm(a - b[list(order)], axis=1).mean() for order in itertools.permutations(range(4))
        ]
        assert contact_distance_m(a, b) == pytest.approx(min(costs))
    assert diversity_m([a]) is None
    assert diversity_m([a, a[::-1]]) == 0.0
    assert diversity_m([a, b]) == contact_distance_m(a, b)
