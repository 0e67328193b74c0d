import dataclasses

import numpy as np
import pytest

from graspbench.errors import PlanningError
from graspbench.grasp.closure import force_closure
from graspbench.grasp.quality import QualityParameters
from graspbench.hand import GraspChecker, HandParameters, load_hand
from graspbench.planning.barrier import FreeMoves
from graspbench.planning.grip_plane import grip_geometry
from graspbench.planning.index import make_index
from graspbench.planning.indices.force_field import ForceFieldParameters
from graspbench.planning.local import plan_local
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.settling import MAX_REFUSED, Follower, Settler, settle
from tests.planning.shapes import ellipsoid, lifted, radial, shrinking

QUALITY = QualityParameters()


def waved(d):
    return 0.04 * (1 + 0.1 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 0])


def egg():
    return lifted(ellipsoid((0.032, 0.036, 0.05)), 0.06)


def field(n_f=3, **parameters):
    return make_index("force_field", ForceFieldParameters(**parameters), n_f)


def plan(surfaces, index=None, checker=None, n_f=3, quality=QUALITY, **planner):
    planner = {"planes": 3, "rotations": 3, **planner}
    return plan_local(
        iter(surfaces), index or field(n_f), checker, n_f, PlannerParameters(**planner), quality
    )


def same(one, two):
    np.testing.assert_array_equal(one.grasp.vertices, two.grasp.vertices)
    assert one.quality == two.quality


@pytest.mark.parametrize("select", ["first", "index", "quality"])
@pytest.mark.parametrize("n_f", [3, 4])
def test_ends_on_the_last_surface_in_a_force_closure_grasp(n_f, select):
    surfaces = shrinking(radial(waved), steps=6)
    found = plan(surfaces, n_f=n_f, select=select)
    last = surfaces[-1]
    np.testing.assert_array_equal(found.grasp.points, last.points[found.grasp.vertices])
    np.testing.assert_array_equal(found.grasp.normals, last.normals[found.grasp.vertices])
    length = QUALITY.torque_length_m(last.points, last.centroid)
    assert force_closure(found.grasp.points, -found.grasp.normals, last.centroid, QUALITY, length)
    assert found.force_closure
    assert found.quality.q3 > 0
    assert found.iterations == found.surfaces_made == 6
    assert found.evaluations > found.moves > 0


def test_history_leads_from_the_first_ellipsoid_to_the_grasp():
    surfaces = shrinking(radial(waved), steps=6)
    found = plan(surfaces, select="first")
    np.testing.assert_array_equal(found.history[0].vertices, found.initial.vertices)
    np.testing.assert_array_equal(found.history[0].points, surfaces[0].points[found.initial.vertices])
    assert found.history[-1] is found.grasp
    for before, after in zip(found.history, found.history[1:], strict=False):
        for a, b in zip(before.vertices, after.vertices, strict=True):
            assert a == b or b in surfaces[0].network.contour(int(a))


def test_same_input_same_plan():
    surfaces = shrinking(radial(waved), steps=6)
    one, two = plan(surfaces), plan(surfaces)
    same(one, two)
    assert (one.moves, one.evaluations) == (two.moves, two.evaluations)


def test_best_by_quality_is_at_least_as_good_as_the_first():
    surfaces = shrinking(radial(waved), steps=6)
    first, best = plan(surfaces, select="first"), plan(surfaces, select="quality")
    assert np.prod(best.quality) >= np.prod(first.quality)
    assert best.rotations_tried > first.rotations_tried


def test_concurrent_plan_is_the_same_and_reports_both_times():
    surfaces = shrinking(radial(waved), steps=6)
    lockstep, concurrent = plan(surfaces, mode="lockstep"), plan(surfaces)
    same(lockstep, concurrent)
    assert concurrent.surfaces_made == concurrent.iterations == 6
    for found in (lockstep, concurrent):
        assert 0 < found.reconstruction_time_s < found.time_s
        assert 0 < found.planning_time_s <= found.time_s
    assert lockstep.reconstruction_time_s + lockstep.planning_time_s == pytest.approx(
        lockstep.time_s, rel=0.05
    )


def test_local_optimum_that_is_not_force_closure_is_never_a_grasp():
    surfaces = shrinking(ellipsoid((0.03, 0.04, 0.08)), steps=4)
    with pytest.raises(PlanningError, match="not force closure") as caught:
        plan(surfaces, quality=QualityParameters(friction=1e-3))
    assert caught.value.data["tried"] >= 9
    assert set(caught.value.data["reasons"]) == {"not force closure"}


@dataclasses.dataclass
class BackAndForth:
    """An index that cannot decide between two neighbours."""

    asked: int = 0

    def propose(self, surface, vertices, moves):
        self.asked += 1
        proposed = vertices.copy()
        proposed[0] = surface.network.contour(int(vertices[0]))[0 if self.asked % 2 else 2]
        return proposed

    def score(self, surface, vertices):
        return 0.0


class Circling(BackAndForth):
    """An index that walks around a triangle of nodes for ever."""

    def propose(self, surface, vertices, moves):
        around = surface.network.contour(700)[[0, 1, 2]].tolist()
        proposed = vertices.copy()
        here = int(vertices[0])
        proposed[0] = around[(around.index(here) + 1) % 3] if here in around else around[0]
        return proposed


@pytest.mark.parametrize("index", [BackAndForth(), Circling()])
def test_cycles_are_detected(index):
    found = plan(shrinking(radial(waved), steps=3), index=index, select="first", max_moves=10_000)
    assert found.cycles >= 1
    assert found.moves < 5000


class Refusing:
    """A hand that holds only what it is told to."""

    def __init__(self, accepts):
        self.hand = load_hand(HandParameters(fingers=3))
        self.ground_height_m = None
        self.pair_limit_m = 1.0
        self._accepts = accepts
        self._real = GraspChecker(self.hand, None)

    def place(self, points, normals, *, start=None):
        return self._real.place(points, normals, start=start) if self._accepts(points) else None

    def reason(self, points, normals):
        return "the hand refuses"

    def vertex_mask(self, points, normals):
        return np.ones(len(points), dtype=bool)

    def set_object(self, points, faces=None):
        pass


def test_says_why_no_grasp_is_possible():
    with pytest.raises(PlanningError, match=r"the hand refuses \(\d+ times\)"):
        plan(shrinking(egg(), steps=3), checker=Refusing(lambda points: False))


def test_takes_the_next_plane_when_the_hand_cannot_hold_the_first():
    def tilted(points):
        geometry = grip_geometry(points, egg().centroid)
        return abs(geometry.normal[2]) < 0.95

    found = plan(shrinking(egg(), steps=3), checker=Refusing(tilted), planes=1)
    assert found.initial.plane > 0
    assert tilted(found.grasp.points)


def test_goes_back_to_where_the_hand_could_follow():
    surface = radial(waved)
    reachable = surface.points[:, 2] < 0.02

    def low(points):
        return bool(np.all(points[:, 2] < 0.02))

    climbing = field(k_cm=0.0)
    found = plan(shrinking(surface, steps=3), index=climbing, checker=Refusing(low))
    assert low(found.grasp.points)
    assert reachable[found.grasp.vertices].all()


def test_a_walk_asks_the_hand_in_vain_a_few_times_only():
    surface, asked = radial(waved), []

    def refuse(points):
        asked.append(points)
        return False

    follower = Follower(np.array([0, 1, 2]))
    settler = Settler(field(), FreeMoves(), Refusing(refuse), max_moves=500, wrist_moves=1)
    assert not settle(follower, surface, settler)
    assert follower.moves > 0
    assert MAX_REFUSED <= len(asked) <= MAX_REFUSED + 1


@pytest.fixture(scope="module")
def held():
    checker = GraspChecker(load_hand(HandParameters(fingers=3)))
    return checker, plan(shrinking(egg(), steps=4), checker=checker)


def test_posture_of_the_grasp_is_feasible(held):
    checker, found = held
    posture, hand = found.grasp.posture, checker.hand
    tips = hand.tip_positions(posture.joints)[list(posture.fingers)]
    world = tips @ posture.transform_palm_to_world[:3, :3].T + posture.transform_palm_to_world[:3, 3]
    wanted = found.grasp.points + hand.tip_radius_m * found.grasp.normals
    assert np.linalg.norm(world - wanted, axis=1).max() <= 1e-4
    assert np.all(posture.joints >= hand.lower)
    assert np.all(posture.joints <= hand.upper)
    assert posture.smallest_singular_value > hand.margins.singular_value_m
    assert posture.clearance_m > -1e-4
    assert checker.place(found.grasp.points, found.grasp.normals, start=posture) is not None
    assert found.contour_queries > 0


def test_grasp_with_a_hand_is_equilateral_in_a_plane_through_the_centroid(held):
    # By the thesis' rule; the default moves a grasp at rest on towards equilibrium.
    checker, balanced = held
    by_the_thesis = plan(shrinking(egg(), steps=4), index=field(rest="single"), checker=checker)
    for found, error_deg in ((by_the_thesis, 3.0), (balanced, 10.0)):
        geometry = grip_geometry(found.grasp.points, found.grasp.centroid)
        assert geometry.equilateral_error_deg < error_deg
        assert geometry.plane_offset_m < 2e-3


def test_needs_a_surface():
    with pytest.raises(PlanningError, match="no surface"):
        plan([])
