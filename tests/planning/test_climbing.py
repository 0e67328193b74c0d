"""Climbs of many grasps at once."""

import numpy as np

from graspbench.planning.climbing import all_different, climb_all, climbs_by_itself, moved_to_allowed, scores
from graspbench.planning.index import make_index
from graspbench.planning.indices.force_field import ForceFieldParameters
from graspbench.planning.indices.mirtich_canny import MirtichCannyParameters
from graspbench.planning.trails import Trails
from tests.planning.shapes import radial

SURFACE = radial(lambda d: 0.04 * (1 + 0.1 * d[:, 0]))


def random_grasps(count, n_f=3, seed=0):
    rng = np.random.default_rng(seed)
    return np.array([rng.choice(len(SURFACE.points), n_f, replace=False) for _ in range(count)])


def test_contacts_go_to_the_nearest_allowed_nodes():
    allowed = np.random.default_rng(1).random(len(SURFACE.points)) < 0.3
    grasps = random_grasps(40)
    moved = moved_to_allowed(SURFACE, grasps, allowed)
    for before, after in zip(grasps.ravel(), moved.ravel(), strict=True):
        apart = np.linalg.norm(SURFACE.points - SURFACE.points[before], axis=1)
        assert allowed[after]
        assert apart[after] <= apart[allowed].min() + 1e-9
        if allowed[before]:
            assert after == before


def test_where_nothing_or_everything_is_allowed_no_contact_goes_elsewhere():
    grasps = random_grasps(5)
    for allowed in (np.zeros(len(SURFACE.points), dtype=bool), np.ones(len(SURFACE.points), dtype=bool)):
        np.testing.assert_array_equal(moved_to_allowed(SURFACE, grasps, allowed), grasps)


def test_a_node_touched_twice_is_seen():
    assert all_different(np.array([[1, 2, 3], [4, 2, 4], [7, 7, 1], [0, 1, 2]])).tolist() == [
        True,
        False,
        False,
        True,
    ]


def test_an_index_without_a_climb_of_its_own_climbs_by_its_proposals():
    index = make_index("mirtich_canny", MirtichCannyParameters(), 3)
    assert not climbs_by_itself(index)
    assert climbs_by_itself(make_index("force_field", ForceFieldParameters(), 3))
    everywhere = np.ones(len(SURFACE.points), dtype=np.bool_)
    climbs = climb_all(index, SURFACE, random_grasps(3), everywhere, thorough=True, max_moves=20)
    assert climbs.first[0] == 0
    assert climbs.first[-1] == len(climbs.paths)
    for rank in range(3):
        merits = scores(index, SURFACE, climbs.path(rank))
        assert np.all(np.diff(merits) > 0)


def test_trails_tell_the_ways_of_grasps_apart():
    index = make_index("force_field", ForceFieldParameters(), 3)
    everywhere = np.ones(len(SURFACE.points), dtype=np.bool_)
    grasps, names = random_grasps(6), np.arange(6)
    trails = Trails()
    trails.stand(SURFACE, names, grasps)
    climbs = climb_all(index, SURFACE, grasps[[4, 1]], everywhere, thorough=False, max_moves=50)
    trails.climb(SURFACE, np.array([4, 1]), climbs)
    assert [vertices.tolist() for _, vertices in trails.of(0)] == [grasps[0].tolist()]
    way = np.array([vertices for _, vertices in trails.of(1)])
    np.testing.assert_array_equal(way, np.vstack((grasps[1:2], climbs.path(1))))
    assert trails.moves == len(climbs.paths) - 2
    assert trails.evaluations == len(climbs.paths)


def test_a_fork_shares_the_beginning_of_a_way_only():
    grasps, trails = random_grasps(3), Trails()
    trails.stand(SURFACE, np.arange(3), grasps)
    early = trails.legs
    trails.stand(SURFACE, np.arange(3), grasps[::-1])
    trails.fork(np.array([3]), np.array([0]), early)
    trails.stand(SURFACE, np.array([0, 3]), random_grasps(2, seed=9))
    assert [vertices.tolist() for _, vertices in trails.of(3)] == [
        grasps[0].tolist(),
        random_grasps(2, seed=9)[1].tolist(),
    ]
    assert len(trails.of(0)) == 3
