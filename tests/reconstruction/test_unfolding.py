import numpy as np

from graspbench.geometry.intersections import self_intersections
from graspbench.reconstruction import build_network
from graspbench.reconstruction.ellipsoid import Ellipsoid
from graspbench.reconstruction.sampling import sample_ellipsoid
from graspbench.reconstruction.unfolding import unfold


def _ball():
    network = build_network(20, 15)
    return network, sample_ellipsoid(Ellipsoid(np.zeros(3), np.eye(3), np.full(3, 0.05)), network, 0.5)


def test_a_smooth_surface_is_left_alone():
    network, points = _ball()
    before = points.copy()
    assert not unfold(points, network)
    np.testing.assert_array_equal(points, before)


def test_a_node_dragged_over_its_neighbours_is_drawn_back():
    network, points = _ball()
    node = 1 + 7 * network.meridians + 3
    beyond = node + 3
    points[node] = 1.02 * points[beyond] + 0.3 * (points[beyond] - points[node])
    assert self_intersections(points, network.faces).any()
    untouched = np.setdiff1d(np.arange(network.size), np.append(network.contour(node), node))
    before = points.copy()
    rounds = 0
    while unfold(points, network):
        rounds += 1
        assert rounds < 30
    assert rounds > 0
    assert not self_intersections(points, network.faces).any()
    far = np.linalg.norm(before[untouched] - before[node], axis=1) > 0.06
    np.testing.assert_array_equal(points[untouched][far], before[untouched][far])
