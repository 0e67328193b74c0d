"""What the search proves, and what it only believes because the posture solver found nothing."""

from functools import partial
from itertools import combinations, product

import numpy as np
import pytest

from graspbench.grasp import QualityParameters, grasp_quality
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.hand.posture import HandPosture
from graspbench.planning import RefineParameters, SearchParameters, plan_global, refine
from tests.planning.shapes import ellipsoid, lifted

QUALITY = QualityParameters()
SURFACE = ellipsoid((0.03, 0.036, 0.045), meridians=6, parallels=5)
UNHURRIED = SearchParameters(time_limit_s=3600.0, climbs=2)
MODELS = (
    QualityParameters(),
    QualityParameters(contact="frictionless", wrench_space="planar_force"),
    QualityParameters(wrench_space="planar"),
)


def posture(n_f):
    return HandPosture(np.eye(4), np.zeros(4 * n_f), tuple(range(n_f)), 0.0, 0.1, 0.01, 0.01)


class Hand:
    """A hand whose solver does not find what it could hold, and that cannot hold everything.

    Args:
        misses: Tells of contacts whether ``place`` misses them.
        finds_late: Whether a patient search finds what ``place`` misses.
        excluded: Tells of contacts whether they are out of reach, and known to be.
    """

    pair_limit_m = np.inf

    def __init__(self, misses, *, finds_late=False, excluded=lambda points: False):
        self.misses, self.finds_late, self.excluded = misses, finds_late, excluded

    def vertex_mask(self, points, normals):
        return np.ones(len(points), dtype=bool)

    def place(self, points, normals, *, start=None):
        return None if self.excluded(points) or self.misses(points) else posture(len(points))

    def place_near(self, points, normals, near):
        return self.place(points, normals)

    def place_patiently(self, points, normals, near):
        if self.finds_late and not self.excluded(points):
            return posture(len(points))
        return self.place(points, normals)

    def excludes(self, points, normals):
        return bool(self.excluded(points))


def wide(points):
    """Tell whether contacts are far apart, as those of the best grasps are."""
    return max(np.linalg.norm(a - b) for a, b in combinations(points, 2)) > 0.07


def good(measure):
    """Return what tells of contacts whether they are among the best few per cent by a measure."""
    least = 0.97 * best_value(measure, lambda points: True)
    length = QUALITY.torque_length_m(SURFACE.points, SURFACE.centroid)

    def tell(points):
        nodes = np.argmin(np.linalg.norm(SURFACE.points[:, None] - points[None], axis=2), axis=0)
        normals = SURFACE.normals[nodes]
        found = grasp_quality(points, -normals, SURFACE.centroid, torque_length=length)
        return getattr(found, measure) > least

    return tell


def best_value(measure, keep):
    triples = np.array(
        [t for t in combinations(range(len(SURFACE.points)), 3) if keep(SURFACE.points[list(t)])]
    )
    length = QUALITY.torque_length_m(SURFACE.points, SURFACE.centroid)
    found = grasp_quality(
        SURFACE.points[triples], -SURFACE.normals[triples], SURFACE.centroid, torque_length=length
    )
    return float(np.asarray(getattr(found, measure))[np.asarray(found.q3) > 1e-9].max())


search = partial(plan_global, SURFACE, n_f=3, quality=QUALITY, search=UNHURRIED)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_what_the_solver_only_misses_stays_in_the_bound(measure):
    missed = good(measure)
    found = search(measure=measure, checker=Hand(missed))
    everything, not_missed = best_value(measure, lambda p: True), best_value(measure, lambda p: not missed(p))
    assert everything > 1.01 * not_missed
    assert found.value == pytest.approx(not_missed, rel=1e-9)
    assert found.upper_bound == pytest.approx(everything, rel=1e-9)
    assert found.upper_bound_up_to_solver == found.value
    assert found.optimal_up_to_solver
    assert not found.optimal
    assert found.doubtful > 0
    assert found.gap == pytest.approx(1.0 - not_missed / everything)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_what_is_found_late_is_found(measure):
    missed = good(measure)
    found = search(measure=measure, checker=Hand(missed, finds_late=True))
    assert found.value == pytest.approx(best_value(measure, lambda p: True), rel=1e-9)
    assert found.optimal
    assert found.grasp.posture is not None
    assert missed(found.grasp.points)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_what_is_proved_out_of_reach_is_left_out(measure):
    found = search(measure=measure, checker=Hand(lambda p: False, excluded=wide))
    assert (
        found.value
        == found.upper_bound
        == pytest.approx(best_value(measure, lambda p: not wide(p)), rel=1e-9)
    )
    assert found.optimal
    assert found.doubtful == 0


def test_the_largest_outer_triangle_keeps_its_doubts_too():
    found = search(measure="mirtich_canny", checker=Hand(wide))
    late = search(measure="mirtich_canny", checker=Hand(wide, finds_late=True))
    assert late.optimal
    assert late.value > found.value
    assert found.optimal_up_to_solver
    assert not found.optimal
    assert found.upper_bound == pytest.approx(late.value)


@pytest.fixture(scope="module")
def hands():
    return [
        load_hand(HandParameters(fingers=3)),
        load_hand(HandParameters(fingers=3, link_lengths_m=(0.045, 0.035, 0.03))),
    ]


@pytest.mark.parametrize(("k", "model"), [*product(range(2), range(3))])
def test_nothing_found_by_anyone_exceeds_the_bound(hands, k, model):
    """Seeded cases, real hands: climbs from several seeds against the bound of the search before them."""
    rng, quality = np.random.default_rng([k, model]), MODELS[model]
    surface = lifted(ellipsoid(tuple(rng.uniform(0.022, 0.042, 3)), meridians=10, parallels=9), 0.05)
    checker = GraspChecker(hands[k], 0.0)
    checker.set_object(surface.points, surface.network.faces)
    for measure in ("q1", "q2", "q3"):
        found = plan_global(
            surface, measure, 3, quality, SearchParameters(time_limit_s=3.0, climbs=1), checker=checker
        )
        assert found.upper_bound >= found.value
        if found.grasp is None:
            continue
        assert checker.verify(found.grasp.posture, found.grasp.points, found.grasp.normals) == ()
        for seed in range(2):
            climbed = refine(
                found.grasp, surface, measure, quality,
                checker=checker, parameters=RefineParameters(seed=seed, jumps=2, draws=300),
            )  # fmt: skip
            assert climbed.value <= found.upper_bound * (1.0 + 1e-9)


def test_hand_holds_nothing_that_it_excludes(hands):
    checker = GraspChecker(hands[0], 0.0)
    surface = lifted(ellipsoid((0.03, 0.036, 0.05), meridians=12, parallels=11), 0.06)
    checker.set_object(surface.points, surface.network.faces)
    rng = np.random.default_rng(4)
    excluded = 0
    for _ in range(60):
        nodes = rng.choice(len(surface.points), 3, replace=False)
        points, normals = surface.points[nodes], surface.normals[nodes]
        if checker.excludes(points, normals):
            excluded += 1
            assert checker.place(points, normals) is None
    assert 0 < excluded < 60


def test_a_patient_search_finds_what_a_neighbour_shows(hands):
    """A posture is led over to contacts some way off, from the one that holds them now."""
    checker = GraspChecker(hands[0], 0.0)
    surface = lifted(ellipsoid((0.03, 0.036, 0.05), meridians=24, parallels=23), 0.06)
    angles = np.deg2rad(np.array([0.0, 120.0, 240.0]))
    arms = surface.points - surface.centroid
    arms = arms / np.linalg.norm(arms, axis=1, keepdims=True)

    def nodes(turn, height):
        rays = np.column_stack([np.cos(angles + turn), np.sin(angles + turn), np.full(3, height)])
        return np.argmax(arms @ rays.T, axis=0)

    from graspbench.hand.checker import HeldContacts

    here, there = nodes(0.0, 0.1), nodes(0.3, 0.3)
    held = checker.place(surface.points[here], surface.normals[here])
    assert held is not None
    near = [HeldContacts(surface.points[here], surface.normals[here], held)]
    found = checker.place_near(surface.points[there], surface.normals[there], near)
    assert found is not None
    assert checker.verify(found, surface.points[there], surface.normals[there]) == ()
    assert checker.place_near(surface.points[there], surface.normals[there], []) is None
