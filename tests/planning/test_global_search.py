"""The global search against plain enumeration, and its bounds against exact values."""

from itertools import combinations

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.grasp import QualityParameters
from graspbench.grasp.closure import force_closure
from graspbench.planning import SearchParameters, plan_global
from graspbench.planning.ascent import Measure, climb
from graspbench.planning.merit import best_first, merit_of, quality_of
from tests.planning.shapes import ellipsoid

QUALITY = QualityParameters()


def _surface(seed):
    rng = np.random.default_rng(seed)
    return ellipsoid(tuple(rng.uniform(0.02, 0.05, 3)), meridians=6, parallels=5)


def _best_by_enumeration(surface, measure, n_f, allowed=lambda nodes: True):
    length = QUALITY.torque_length_m(surface.points, surface.centroid)
    best = -np.inf
    for nodes in combinations(range(len(surface.points)), n_f):
        if not allowed(nodes):
            continue
        found = quality_of(surface, np.array(nodes), QUALITY, length)
        if found.q3 > 1e-9:
            best = max(best, getattr(found, measure))
    return best


class _Picky:
    """A hand that reaches only the upper half, and only pairs that are not too far apart."""

    def __init__(self, surface, limit_m):
        self.pair_limit_m = limit_m
        self._surface = surface

    def vertex_mask(self, points, normals):
        return points[:, 2] >= self._surface.centroid[2] - 0.022

    def place(self, points, normals, *, start=None):
        return object() if abs(points[:, 0].sum()) < 0.05 else None


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("measure", ["q1", "q2"])
def test_small_surfaces_are_searched_as_by_enumeration(seed, measure):
    surface = _surface(seed)
    found = plan_global(surface, measure, 3, QUALITY, SearchParameters())
    assert found.value == pytest.approx(_best_by_enumeration(surface, measure, 3), rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_q3_comes_near_the_optimum_and_never_above(seed):
    surface = _surface(seed)
    found = plan_global(surface, "q3", 3, QUALITY, SearchParameters(climbs=12))
    best = _best_by_enumeration(surface, "q3", 3)
    assert 0.9 * best <= found.value <= best * (1 + 1e-9)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_constraints_hold_and_none_better_is_missed(measure):
    surface = ellipsoid((0.03, 0.035, 0.04), meridians=6, parallels=5)
    hand = _Picky(surface, 0.068)
    found = plan_global(
        surface, measure, 3, QUALITY, SearchParameters(climbs=20), checker=hand, centre_tolerance_m=0.02
    )
    nodes = found.grasp.vertices
    points = surface.points

    def allowed(nodes):
        chosen = points[list(nodes)]
        gaps = [np.linalg.norm(a - b) for a, b in combinations(chosen, 2)]
        return (
            hand.vertex_mask(chosen, None).all()
            and max(gaps) <= hand.pair_limit_m
            and np.linalg.norm(chosen.mean(axis=0) - surface.centroid) <= 0.02
            and hand.place(chosen, None) is not None
        )

    assert allowed(nodes)
    best = _best_by_enumeration(surface, measure, 3, allowed)
    assert found.value <= best * (1 + 1e-9)
    assert found.value >= (0.9 if measure == "q3" else 1 - 1e-9) * best


def test_a_given_start_is_never_lost():
    surface = ellipsoid((0.03, 0.04, 0.05), meridians=20, parallels=20)
    first = plan_global(surface, "q1", 3, QUALITY, SearchParameters())
    again = plan_global(surface, "q1", 3, QUALITY, SearchParameters(climbs=1), starts=(first.grasp.vertices,))
    assert again.value >= first.value


def test_without_a_certificate_none_is_claimed():
    found = plan_global(_surface(0), "q1", 3, QUALITY, SearchParameters())
    assert not found.optimal
    assert found.gap == 1.0
    assert found.upper_bound >= found.value


def test_nothing_allowed_gives_no_grasp():
    surface = _surface(0)
    found = plan_global(surface, "q2", 3, QUALITY, SearchParameters(), checker=_Picky(surface, 1e-6))
    assert found.grasp is None
    assert found.value == -np.inf


def test_unknown_measure_is_named():
    with pytest.raises(ConfigurationError, match="unknown measure 'q9'"):
        plan_global(_surface(0), "q9", 3, QUALITY, SearchParameters())


@pytest.mark.parametrize("n_f", [3, 4])
@pytest.mark.parametrize("tight", [True, False])
def test_support_bounds_are_above_the_exact_radius(n_f, tight):
    surface = _surface(3)
    rng = np.random.default_rng(n_f)
    nodes = np.array([rng.choice(len(surface.points), n_f, replace=False) for _ in range(40)])
    measure = Measure("q3", surface, QUALITY)
    exact = np.array([measure.value(row) for row in nodes])
    bounds = measure.bounds(nodes, tight=tight)
    assert (bounds >= exact - 1e-12).all()
    assert (exact > 0.01).any()


def test_grasps_come_in_the_order_of_their_exact_merits():
    surface = _surface(5)
    rng = np.random.default_rng(0)
    grasps = [rng.choice(len(surface.points), 3, replace=False) for _ in range(60)]
    length = QUALITY.torque_length_m(surface.points, surface.centroid)
    exact = [merit_of(quality_of(surface, nodes, QUALITY, length)) for nodes in grasps]
    order = list(best_first(surface, grasps, QUALITY, length))
    assert sorted(k for k, _ in order) == list(range(60))
    assert [merit for _, merit in order] == pytest.approx(sorted(exact, reverse=True))
    assert all(merit == pytest.approx(exact[k]) for k, merit in order)


def test_a_climb_ends_where_no_allowed_neighbour_is_better():
    surface = ellipsoid((0.03, 0.035, 0.05), meridians=16, parallels=15)
    measure = Measure("q1", surface, QUALITY)
    start = np.array([40, 120, 200])

    def allowed(nodes):
        return force_closure(
            surface.points[nodes], -surface.normals[nodes], surface.centroid, QUALITY, measure.torque_length_m
        )

    top, value, evaluated = climb(start, measure.value(start), measure, allowed)
    assert evaluated > 0
    assert value >= measure.value(start)
    for i in range(3):
        for node in surface.network.contour(int(top[i])):
            moved = top.copy()
            moved[i] = node
            if len(set(moved.tolist())) == 3 and allowed(moved):
                assert measure.value(moved) <= value * (1 + 1e-9)
