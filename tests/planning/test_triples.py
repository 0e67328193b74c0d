"""All triples of nodes for three frictionless contacts in the plane, against plain enumeration."""

from itertools import combinations

import numpy as np
import pytest

from graspbench.grasp import QualityParameters
from graspbench.planning.search import enumeration
from graspbench.planning.search.engine import Progress
from graspbench.planning.search.enumeration import LARGEST, can_enumerate, enumerate_triples
from graspbench.planning.search.layout import lay_out
from graspbench.planning.search.objectives import CODES, make_objective
from graspbench.planning.search.triples import list_triples, pair_cosines
from tests.planning.shapes import directions

QUALITY = QualityParameters(contact="frictionless", wrench_space="planar_force")
MEASURES = ("q1", "q2", "q3")


def layout_of(points, normals_in, *, quality=QUALITY, n_f=3, pair_m=np.inf, centre_m=np.inf):
    return lay_out(
        points, normals_in, np.zeros(3), quality, 1.0, np.arange(len(points)), n_f,
        np.array([pair_m, centre_m]),
    )  # fmt: skip


def uneven(seed, *, meridians=7, parallels=6, **limits):
    rng = np.random.default_rng(seed)
    rays = directions(meridians, parallels)
    normals = -rays + rng.normal(0.0, 0.25, rays.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return layout_of(rays * rng.uniform(0.03, 0.05, (len(rays), 1)), normals, **limits)


def every_triple(layout):
    triples = np.array(list(combinations(range(len(layout.nodes)), 3)))
    return triples[layout.within_limits(triples)]


def listed(layout, measure, floor, ceiling=np.inf, compatible=None):
    n = len(layout.nodes)
    compatible = np.ones((n, n), dtype=bool) if compatible is None else compatible
    triples, values = np.empty((n**3 // 6, 3), dtype=np.int64), np.empty(n**3 // 6)
    found = list_triples(
        layout.points, layout.normals_in, compatible, CODES[measure], layout.centroid,
        float(layout.limits[1]), floor, ceiling, 0, n, triples, values,
    )  # fmt: skip
    return {tuple(sorted(t)): v for t, v in zip(triples[:found].tolist(), values, strict=False)}


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("centre_m", [np.inf, 0.012])
def test_values_are_those_of_the_measures(measure, centre_m):
    layout = uneven(1, centre_m=centre_m)
    triples = every_triple(layout)
    exact = layout.measure(triples, measure, -np.inf)
    found = listed(layout, measure, 0.0)
    closed = exact > 0.0
    assert 20 < closed.sum() < len(triples)
    for triple, value in zip(triples[closed].tolist(), exact[closed], strict=True):
        assert found.pop(tuple(triple)) == pytest.approx(value, rel=1e-6)
    assert all(value < 1e-6 for value in found.values())  # a triangle with the origin on its border


@pytest.mark.parametrize("measure", MEASURES)
def test_floor_and_ceiling_part_the_list(measure):
    layout = uneven(2)
    whole = listed(layout, measure, 0.0)
    cut = float(np.median(list(whole.values())))
    above, below = listed(layout, measure, cut), listed(layout, measure, 0.0, cut)
    assert above
    assert below
    assert {**above, **below} == whole
    assert not above.keys() & below.keys()


@pytest.mark.parametrize("measure", MEASURES)
def test_no_pair_of_a_better_grasp_is_left_out(measure):
    """Random normals, any plane: with a third of the triples near the largest value there can be."""
    rng, seen = np.random.default_rng(3), 0
    for spread in (0.02, 0.1, 0.3, 1.0):
        angles = np.deg2rad([0.0, 120.0, 240.0])
        for _ in range(400):
            normals = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
            normals += rng.normal(0.0, spread, (3, 3))
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            points = -normals + rng.normal(0.0, spread, (3, 3))
            layout = layout_of(points, normals)
            value = layout.measure(np.array([[0, 1, 2]]), measure, -np.inf)[0]
            if value <= 0.0:
                continue
            seen += 1
            assert value <= LARGEST[CODES[measure]] * (1.0 + 1e-9)
            low, high = pair_cosines(CODES[measure], float(value))
            cosines = (normals @ normals.T)[np.triu_indices(3, 1)]
            assert low - 1e-9 <= cosines.min()
            assert cosines.max() <= high + 1e-9
    assert seen > 800


@pytest.mark.parametrize("measure", MEASURES)
def test_near_the_largest_value_pairs_have_to_be_at_120_degrees(measure):
    low, high = pair_cosines(CODES[measure], 0.999 * LARGEST[CODES[measure]])
    assert -0.7 < low < -0.5 < high < -0.3
    assert pair_cosines(CODES[measure], 0.0) == (-1.0, 1.0)


@pytest.mark.parametrize("measure", MEASURES)
def test_contacts_on_a_line_are_never_below_their_value(measure):
    """Of exact lines the plane follows from the normals, of nearly exact ones from rounding."""
    rng = np.random.default_rng(4)
    for bend in (0.0, 1e-12, 1e-8, 1e-6):
        for _ in range(60):
            normals = rng.standard_normal((3, 3))
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            points = np.outer([0.0, 0.5, 1.0], rng.standard_normal(3)) + bend * rng.standard_normal((3, 3))
            layout = layout_of(points, normals)
            exact = layout.measure(np.array([[0, 1, 2]]), measure, -np.inf)[0]
            if exact > 1e-6:
                assert listed(layout, measure, 0.0)[0, 1, 2] >= exact


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("kept", [1 << 21, 60])
def test_the_best_that_is_accepted_is_found_however_few_are_kept(measure, kept, monkeypatch):
    monkeypatch.setattr(enumeration, "MAX_LISTED", kept)
    monkeypatch.setattr(enumeration, "ROOM", 8)
    layout = uneven(5, pair_m=0.075)
    triples = every_triple(layout)
    values = layout.measure(triples, measure, -np.inf)
    order = np.argsort(-values)
    refused = {tuple(sorted(t)) for t in triples[order[:200]].tolist()}
    asked = []

    def accept(leaves, value):
        asked.append(value)
        return -np.inf if tuple(sorted(leaves.tolist())) in refused else value

    progress = enumerate_triples(
        layout, make_objective(layout, measure), CODES[measure], accept,
        threads=1, out_of_time=lambda: False, start=Progress(-np.inf, None, np.inf),
    )  # fmt: skip
    assert progress.finished
    assert progress.best == progress.upper_bound == values[order[200]]
    assert len(asked) == 201


def test_when_time_is_up_the_largest_value_there_can_be_is_the_bound():
    layout = uneven(6)
    progress = enumerate_triples(
        layout, make_objective(layout, "q1"), CODES["q1"], lambda leaves, value: value,
        threads=1, out_of_time=lambda: True, start=Progress(-np.inf, None, np.inf),
    )  # fmt: skip
    assert not progress.finished
    assert progress.upper_bound == pytest.approx(1.5**0.5)


def test_other_problems_are_not_problems_of_triples():
    assert can_enumerate(uneven(0), "q3")
    assert not can_enumerate(uneven(0, n_f=4), "q1")
    assert not can_enumerate(uneven(0, quality=QualityParameters()), "q1")
    linf = QualityParameters(contact="frictionless", wrench_space="planar_force", norm="linf")
    assert not can_enumerate(uneven(0, quality=linf), "q3")
    assert can_enumerate(uneven(0, quality=linf), "q1")
