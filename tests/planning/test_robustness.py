"""What a grasp is worth when its contacts are not quite where they were planned."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from graspbench.grasp.internal_forces import friction_reserve
from graspbench.grasp.quality import QualityParameters, grasp_quality
from graspbench.planning.index import make_index
from graspbench.planning.indices.force_field import ForceFieldParameters
from graspbench.planning.indices.mirtich_canny import MirtichCannyParameters
from graspbench.planning.indices.quality_ascent import QualityAscentParameters
from graspbench.planning.judge import Candidate, Judge
from graspbench.planning.local import plan_local
from graspbench.planning.parameters import PlannerParameters, RobustParameters
from graspbench.planning.robustness import Robustness
from tests.planning.shapes import ellipsoid, radial, shrinking

QUALITY = QualityParameters()
EXACT = RobustParameters(samples=3, position_sigma_m=0.0, normal_sigma_deg=0.0, friction_sigma=0.0)
INDICES = {
    "force_field": ForceFieldParameters(),
    "mirtich_canny": MirtichCannyParameters(),
    "quality_ascent": QualityAscentParameters(),
}


def nodes_at(surface, azimuths_deg, height=0.0):
    angles = np.deg2rad(azimuths_deg)
    rays = np.column_stack((np.cos(angles), np.sin(angles), np.full(len(angles), height)))
    arms = surface.points - surface.centroid
    return np.argmax(arms / np.linalg.norm(arms, axis=1, keepdims=True) @ rays.T, axis=0)


def test_without_errors_it_is_q3_itself():
    surface = ellipsoid((0.03, 0.035, 0.04))
    vertices = nodes_at(surface, [0, 120, 240])
    q3 = grasp_quality(
        surface.points[vertices],
        -surface.normals[vertices],
        surface.centroid,
        torque_length=QUALITY.torque_length_m(surface.points, surface.centroid),
    ).q3
    assert Robustness(surface, QUALITY, EXACT).expected_q3(vertices) == pytest.approx(q3, rel=1e-9)


def test_all_grasps_meet_the_same_errors_and_the_seed_draws_them():
    surface = ellipsoid((0.03, 0.035, 0.04))
    vertices = nodes_at(surface, [0, 120, 240])
    parameters = RobustParameters(samples=30)
    first = Robustness(surface, QUALITY, parameters).samples_q3(vertices)
    np.testing.assert_array_equal(first, Robustness(surface, QUALITY, parameters).samples_q3(vertices))
    other = Robustness(surface, QUALITY, replace(parameters, seed=1)).samples_q3(vertices)
    assert not np.array_equal(first, other)


def test_a_tilt_of_known_size_costs_what_the_cone_says():
    # Two soft contacts face each other: tilted by more than the friction angle they hold nothing.
    surface = ellipsoid((0.03, 0.03, 0.03))
    vertices = nodes_at(surface, [0, 180])
    soft = QualityParameters(contact="soft_finger")
    calm = RobustParameters(samples=60, position_sigma_m=0.0, normal_sigma_deg=1.0, friction_sigma=0.0)
    assert (Robustness(surface, soft, calm).samples_q3(vertices) > 0.0).all()
    rough = replace(calm, normal_sigma_deg=40.0)
    assert (Robustness(surface, soft, rough).samples_q3(vertices) > 0.0).mean() < 0.5


def test_contacts_on_narrow_crests_are_worth_less_than_the_same_contacts_on_a_smooth_body():
    def crests(d):
        return 0.03 * (1.0 + 0.06 * (np.cos(12 * np.arctan2(d[:, 1], d[:, 0])) - 1.0) * (1 - d[:, 2] ** 2))

    errors = RobustParameters(samples=90, position_sigma_m=0.003, normal_sigma_deg=0.0)
    kept = []
    for surface in (ellipsoid((0.03, 0.03, 0.03), meridians=60), radial(crests, meridians=60)):
        vertices = nodes_at(surface, [0, 120, 240])
        exact = Robustness(surface, QUALITY, EXACT).expected_q3(vertices)
        kept.append(Robustness(surface, QUALITY, errors).expected_q3(vertices) / exact)
    assert kept[0] > 0.8
    assert kept[1] < 0.8 * kept[0]


def test_the_other_side_of_a_thin_wall_is_no_neighbour():
    surface = ellipsoid((0.04, 0.04, 0.0005))
    top = int(np.argmax(surface.points[:, 2] - 10.0 * np.linalg.norm(surface.points[:, :2], axis=1)))
    parameters = RobustParameters(samples=60, position_sigma_m=0.003, normal_sigma_deg=0.0)
    _, normals = Robustness(surface, QUALITY, parameters)._moved(
        np.array([top]), 0.003 * np.random.default_rng(0).standard_normal((60, 1, 2))
    )
    assert (normals[..., 2] > 0.0).all()


@pytest.mark.parametrize("name", INDICES)
def test_with_any_index_the_most_robust_of_its_best_is_taken(name):
    def radius(d):
        return 0.03 * (
            1.0 + 0.15 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 2]
        )

    surfaces = shrinking(radial(radius), steps=5)
    index = make_index(name, INDICES[name], 3, QUALITY)

    def plan(among):
        planner = PlannerParameters(planes=4, followers=12, robust=RobustParameters(among=among, samples=24))
        return plan_local(iter(surfaces), index, None, 3, planner, QUALITY)

    measure = Robustness(surfaces[-1], QUALITY, RobustParameters(samples=24))
    plain, robust = plan(1), plan(8)
    worth = [measure.expected_q3(found.grasp.vertices) for found in (plain, robust)]
    assert worth[1] >= worth[0] * (1 - 1e-9)
    assert all(a <= b for a, b in itertools.pairwise([0.0, *worth]))


@pytest.mark.parametrize("name", INDICES)
def test_of_grasps_that_an_index_thinks_equal_one_keeps_friction(name):
    def radius(d):  # a top that tapers: friction is lost on its flanks
        return 0.03 * (
            1.0 - 0.35 * d[:, 2] + 0.1 * np.cos(2 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2)
        )

    surfaces = shrinking(radial(radius), steps=5)
    index = make_index(name, INDICES[name], 3, QUALITY)

    def plan(**chosen):
        robust = RobustParameters(**chosen)
        planner = PlannerParameters(planes=4, followers=12, robust=robust)
        found = plan_local(iter(surfaces), index, None, 3, planner, QUALITY)
        grasp = found.grasp
        reserve = friction_reserve(grasp.points - grasp.centroid, -grasp.normals, QUALITY.friction)
        return found.score, reserve

    plain_score, plain = plan(reserve=0.0)
    for wanted in (0.3, 0.95):
        score, kept = plan(reserve=wanted, tolerance=0.2, equals=30)
        assert score >= plain_score - 0.2 * abs(plain_score) - 1e-12
        assert kept >= min(wanted, plain) - 0.04
    same = plan(reserve=0.95, tolerance=0.0)
    assert same[0] == pytest.approx(plain_score)


def test_friction_in_reserve_decides_among_equals_only():
    index = make_index("force_field", ForceFieldParameters(), 3, QUALITY)
    judge = Judge(
        index, None, PlannerParameters(robust=RobustParameters(reserve=0.45, tolerance=0.1)), QUALITY
    )

    def candidate(merit, reserve):
        return Candidate(None, None, None, merit, merit, reserve)

    best, firm, other = candidate(3.0, 0.2), candidate(2.8, 0.45), candidate(2.75, 0.3)
    assert judge.best([best, other]) is other
    assert judge.best([best, other, firm]) is firm
    assert judge.best([best, candidate(2.6, 0.45)]) is best  # too far below to count as equal
    assert not judge.enough([best], 2.9)
    assert judge.enough([best], 2.6)
    assert judge.enough([best, firm], 2.8)
    assert not judge.enough([best, firm], 2.85)
    assert judge.enough([candidate(-1.0, 0.2)], -1.2)
    assert not judge.enough([candidate(-1.0, 0.2)], -1.05)
