"""The global search against plain enumeration, and its bounds against exact values."""

import dataclasses
from functools import partial
from itertools import combinations, product

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.grasp import Grasp, QualityParameters, grasp_quality
from graspbench.grasp.wrench import wrench_maps
from graspbench.hand.posture import HandPosture
from graspbench.planning import SearchParameters, plan_global
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores
from graspbench.planning.merit import best_first, merit_of, quality_of, support_bounds
from graspbench.planning.search.layout import lay_out
from graspbench.planning.search.objectives import make_objective
from tests.planning.shapes import ellipsoid

QUALITY = QualityParameters()
unhurried = partial(SearchParameters, time_limit_s=3600.0)  # the limit counts compilation and a busy machine


def _surface(seed):
    rng = np.random.default_rng(seed)
    return ellipsoid(tuple(rng.uniform(0.02, 0.05, 3)), meridians=6, parallels=5)


def _best_by_enumeration(surface, measure, n_f, allowed=lambda nodes: True, quality=QUALITY):
    chosen = [nodes for nodes in combinations(range(len(surface.points)), n_f) if allowed(nodes)]
    found = grasp_quality(
        surface.points[np.array(chosen)],
        -surface.normals[np.array(chosen)],
        surface.centroid,
        contact=quality.contact,
        wrench_space=quality.wrench_space,
        friction=quality.friction,
        cone_edges=quality.cone_edges,
        torque_length=quality.torque_length_m(surface.points, surface.centroid),
        torsional_friction=quality.torsion(quality.torque_length_m(surface.points, surface.centroid)),
        norm=quality.norm,
    )
    values = np.asarray(getattr(found, measure))
    return float(values[np.asarray(found.q3) > 1e-9].max())


def _posture(n_f):
    return HandPosture(np.eye(4), np.zeros(4 * n_f), tuple(range(n_f)), 0.0, 0.1, 0.01, 0.01)


class _Picky:
    """A hand that reaches only the upper half, and only pairs that are not too far apart."""

    def __init__(self, surface, limit_m):
        self.pair_limit_m = limit_m
        self._surface = surface

    def vertex_mask(self, points, normals):
        return points[:, 2] >= self._surface.centroid[2] - 0.022

    def place(self, points, normals, *, start=None):
        return None if self.excludes(points, normals) else _posture(len(points))

    def place_near(self, points, normals, near):
        return self.place(points, normals)

    def place_patiently(self, points, normals, near):
        return self.place(points, normals)

    def excludes(self, points, normals):
        return abs(points[:, 0].sum()) >= 0.05


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
@pytest.mark.parametrize(("n_f", "seed"), [(2, 0), (3, 0), (3, 1), (4, 2)])
def test_the_certified_optimum_is_that_of_enumeration(measure, n_f, seed):
    rng = np.random.default_rng(seed)
    meridians, parallels = (6, 5) if n_f < 4 else (4, 4)
    quality = QualityParameters(contact="soft_finger") if n_f == 2 else QUALITY
    surface = ellipsoid(tuple(rng.uniform(0.02, 0.05, 3)), meridians=meridians, parallels=parallels)
    found = plan_global(surface, measure, n_f, quality, unhurried(climbs=seed % 2))
    best = _best_by_enumeration(surface, measure, n_f, quality=quality)
    assert found.optimal
    assert found.gap == 0.0
    assert found.upper_bound == found.value == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("contact", ["hard_finger", "soft_finger", "soft_pad"])
@pytest.mark.parametrize("norm", ["l1", "linf"])
def test_every_contact_model_and_norm_is_certified(contact, norm):
    quality = QualityParameters(contact=contact, norm=norm, cone_edges=4)
    surface = ellipsoid((0.03, 0.025, 0.04), meridians=5, parallels=4)
    found = plan_global(surface, "q3", 3, quality, unhurried())
    assert found.optimal
    assert found.value == pytest.approx(_best_by_enumeration(surface, "q3", 3, quality=quality), rel=1e-9)


def _uneven(seed, meridians, parallels):
    """Return a surface with no symmetry, so that no two grasps are alike."""
    rng = np.random.default_rng(seed)
    surface = ellipsoid(tuple(rng.uniform(0.02, 0.05, 3)), meridians=meridians, parallels=parallels)
    normals = surface.normals + rng.normal(0.0, 0.2, surface.normals.shape)
    points = surface.points + rng.normal(0.0, 1e-3, surface.points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return dataclasses.replace(surface, points=points, normals=normals)


PLANAR = [
    ("frictionless", "planar_force", 8, "l1"),
    ("frictionless", "planar_force", 8, "linf"),
    ("hard_finger", "planar_force", 8, "l1"),
    ("hard_finger", "planar", 8, "l1"),
    ("hard_finger", "planar", 5, "linf"),
    ("soft_finger", "planar", 4, "l1"),
    ("frictionless", "planar", 8, "l1"),
]


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
@pytest.mark.parametrize(("contact", "space", "edges", "norm"), PLANAR)
@pytest.mark.parametrize("n_f", [3, 4])
def test_planar_wrench_spaces_are_certified(measure, contact, space, edges, norm, n_f):
    quality = QualityParameters(contact=contact, wrench_space=space, cone_edges=edges, norm=norm)
    if space == "planar_force" and contact != "frictionless" and measure != "q3":
        pytest.skip("the same value for every grasp")
    if contact == "frictionless" and space == "planar" and n_f == 3:
        pytest.skip("never force closure")
    surface = _uneven(n_f, *((5, 4) if n_f == 3 else (4, 3)))
    found = plan_global(surface, measure, n_f, quality, unhurried(climbs=1))
    best = _best_by_enumeration(surface, measure, n_f, quality=quality)
    assert found.optimal
    assert found.value == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
@pytest.mark.parametrize(("contact", "space", "edges", "norm"), PLANAR[::2])
def test_planar_bounds_hold_for_every_grasp_of_the_clusters(measure, contact, space, edges, norm):
    quality = QualityParameters(contact=contact, wrench_space=space, cone_edges=edges, norm=norm)
    surface = _uneven(7, 10, 9)
    length = quality.torque_length_m(surface.points, surface.centroid)
    layout = lay_out(
        surface.points, -surface.normals, surface.centroid, quality, length,
        np.arange(len(surface.points)), 3, np.array([np.inf, np.inf]),
    )  # fmt: skip
    objective, rng = make_objective(layout, measure), np.random.default_rng(0)
    tree, tight = layout.tree, 0
    for _ in range(60):
        sizes = tree.span[:, 1] - tree.span[:, 0]
        clusters = rng.choice(np.flatnonzero(sizes <= rng.choice([1, 3, 8])), 3)
        members = [np.arange(*tree.span[cluster]) for cluster in clusters]
        grasps = np.array([row for row in product(*members) if len(set(row)) == 3])
        if not len(grasps):
            continue
        bounds = np.array([np.inf])
        objective.bound(clusters[None], bounds, -np.inf)
        exact = objective.evaluate(grasps, -np.inf)
        assert exact.max() <= bounds[0]
        promised = objective.promise(grasps, -np.inf)
        assert (exact[exact > 0.0] <= promised[exact > 0.0]).all()
        tight += exact.max() > 0.5 * bounds[0]
    if contact != "frictionless" or space == "planar_force":
        assert tight > 0


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
@pytest.mark.parametrize("contact", ["frictionless", "soft_finger"])
def test_contacts_that_push_across_their_plane_have_a_bound(measure, contact):
    """A flat plate: no force of its nodes has a part in the plane of four nodes of one side."""
    grid = np.array([(x, y, z) for z in (0.0, 0.01) for x in range(4) for y in range(4)]) * [0.01, 0.01, 1.0]
    normals = np.where(grid[:, 2:] > 0.005, [[0.0, 0.0, -1.0]], [[0.0, 0.0, 1.0]])
    quality = QualityParameters(contact=contact, wrench_space="planar_force")
    layout = lay_out(
        grid, normals, grid.mean(axis=0), quality, 1.0, np.arange(len(grid)), 4, np.array([np.inf, np.inf])
    )
    objective, bounds = make_objective(layout, measure), np.full(4, np.inf)
    sides = np.flatnonzero(layout.tree.span[:, 1] - layout.tree.span[:, 0] == 4)[:4]
    objective.bound(np.repeat(sides[:, None], 4, axis=1), bounds, -np.inf)
    assert not np.isnan(bounds).any()


@pytest.mark.parametrize("tolerance_m", [None, 0.004])
def test_the_largest_outer_triangle_is_that_of_enumeration(tolerance_m):
    surface = ellipsoid((0.03, 0.025, 0.04), meridians=7, parallels=6)
    search = unhurried(phi_cei_deg=15.0, phi_eegi_deg=12.0)
    found = plan_global(surface, "mirtich_canny", 3, QUALITY, search, centre_tolerance_m=tolerance_m)
    length = QUALITY.torque_length_m(surface.points, surface.centroid)
    triples = np.array(list(combinations(range(len(surface.points)), 3)))
    cei, eegi, area = mirtich_canny_scores(surface.points[triples], -surface.normals[triples])
    offset = np.linalg.norm(surface.points[triples].mean(axis=1) - surface.centroid, axis=1)
    keep = (cei <= 15.0) & (eegi <= 12.0) & (offset <= (tolerance_m or np.inf))
    best = max(
        a
        for nodes, a in zip(triples[keep], area[keep], strict=True)
        if quality_of(surface, nodes, QUALITY, length).q3 > 1e-9
    )
    assert found.optimal
    assert found.value == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_constraints_hold_and_none_better_is_missed(measure):
    surface = ellipsoid((0.03, 0.035, 0.04), meridians=6, parallels=5)
    hand = _Picky(surface, 0.068)
    found = plan_global(surface, measure, 3, QUALITY, unhurried(), checker=hand, centre_tolerance_m=0.02)
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

    assert allowed(found.grasp.vertices)
    assert found.optimal
    assert found.value == pytest.approx(_best_by_enumeration(surface, measure, 3, allowed), rel=1e-9)


@pytest.mark.parametrize("measure", ["q1", "q2", "q3"])
def test_when_time_is_up_the_bound_still_holds_and_the_start_is_kept(measure):
    surface = ellipsoid((0.03, 0.04, 0.05), meridians=20, parallels=20)
    whole = plan_global(surface, measure, 3, QUALITY, unhurried())
    start = np.array([40, 150, 300])
    points = surface.points[start]
    grasp = Grasp(start, points, surface.normals[start], surface.centroid, None)
    hasty = plan_global(
        surface, measure, 3, QUALITY, SearchParameters(time_limit_s=1e-6, climbs=0), starts=(grasp,)
    )
    assert whole.optimal
    assert not hasty.optimal
    assert hasty.upper_bound >= whole.value
    length = QUALITY.torque_length_m(surface.points, surface.centroid)
    if quality_of(surface, start, QUALITY, length).q3 > 1e-9:
        assert hasty.grasp is grasp
    assert hasty.gap == pytest.approx(1.0 - max(hasty.value, 0.0) / hasty.upper_bound)


def test_a_gap_that_is_allowed_is_not_exceeded():
    surface = ellipsoid((0.03, 0.04, 0.05), meridians=12, parallels=11)
    exact = plan_global(surface, "q3", 3, QUALITY, unhurried())
    loose = plan_global(surface, "q3", 3, QUALITY, unhurried(gap=0.1, climbs=1))
    assert loose.gap <= 0.1
    assert loose.value >= 0.9 * exact.value
    assert loose.upper_bound >= exact.value


@pytest.mark.parametrize("measure", ["q1", "q3"])
def test_threads_do_not_change_the_result(measure):
    surface = ellipsoid((0.03, 0.04, 0.05), meridians=12, parallels=11)
    one, two = (plan_global(surface, measure, 3, QUALITY, unhurried(threads=n)) for n in (1, 2))
    assert one.value == two.value
    assert (one.grasp.vertices == two.grasp.vertices).all()
    assert one.evaluated == two.evaluated


def test_nothing_allowed_gives_no_grasp():
    surface = _surface(0)
    found = plan_global(surface, "q2", 3, QUALITY, unhurried(), checker=_Picky(surface, 1e-6))
    assert found.grasp is None
    assert found.optimal
    assert found.value == -np.inf


def test_unknown_measure_is_named():
    with pytest.raises(ConfigurationError, match="unknown measure 'q9'"):
        plan_global(_surface(0), "q9", 3, QUALITY, unhurried())


def test_the_outer_triangle_wants_three_fingers():
    with pytest.raises(ConfigurationError, match="4 contacts"):
        plan_global(_surface(0), "mirtich_canny", 4, QUALITY, unhurried())


@pytest.mark.parametrize("n_f", [3, 4])
@pytest.mark.parametrize("tight", [True, False])
def test_support_bounds_are_above_the_exact_radius(n_f, tight):
    surface = _surface(3)
    rng = np.random.default_rng(n_f)
    nodes = np.array([rng.choice(len(surface.points), n_f, replace=False) for _ in range(40)])
    length = QUALITY.torque_length_m(surface.points, surface.centroid)
    exact = np.array([quality_of(surface, row, QUALITY, length).q3 for row in nodes])
    maps = wrench_maps(surface.points[nodes], -surface.normals[nodes], surface.centroid, torque_length=length)
    bounds = support_bounds(maps, QUALITY, length, tight=tight)
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
