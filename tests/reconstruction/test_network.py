import numpy as np
import pytest

from graspbench.reconstruction import SurfaceParameters, build_network
from graspbench.reconstruction.ellipsoid import Ellipsoid
from graspbench.reconstruction.sampling import network_of, sample_ellipsoid
from graspbench.reconstruction.solid import enclosed_solid

SIZES = [(3, 1), (4, 2), (7, 5), (12, 3)]


@pytest.mark.parametrize(("meridians", "parallels"), SIZES)
def test_links_are_mutual_and_four_but_at_the_poles(meridians, parallels):
    network = build_network(meridians, parallels)
    links = [
        set(network.link_nodes[network.link_start[a] : network.link_start[a + 1]].tolist())
        for a in range(network.size)
    ]
    assert len(links[0]) == len(links[-1]) == meridians
    assert all(len(links[a]) == 4 for a in range(1, network.size - 1))
    assert all(a in links[b] for a in range(network.size) for b in links[a])


@pytest.mark.parametrize(("meridians", "parallels"), SIZES)
def test_faces_close_a_sphere(meridians, parallels):
    faces = build_network(meridians, parallels).faces
    edges = {(int(f[k]), int(f[(k + 1) % 3])) for f in faces for k in range(3)}
    assert len(edges) == 3 * len(faces)
    assert all((b, a) in edges for a, b in edges)
    assert meridians * parallels + 2 - len(edges) // 2 + len(faces) == 2


@pytest.mark.parametrize(("meridians", "parallels"), [(5, 3), (8, 4)])
def test_contours_run_around_their_node_along_links(meridians, parallels):
    network = build_network(meridians, parallels)
    points = sample_ellipsoid(Ellipsoid(np.zeros(3), np.eye(3), np.ones(3)), network, 0.5)
    for node in range(network.size):
        contour = network.contour(node)
        assert len(set(contour.tolist())) == len(contour)
        if node in (0, network.size - 1):
            assert len(contour) == meridians
        towards = points[contour] - points[node]
        turn = np.cross(towards, np.roll(towards, -1, axis=0)) @ points[node]
        assert np.all(turn > 0)  # counter-clockwise seen from outside


def test_number_of_nodes_follows_the_wish():
    assert network_of(SurfaceParameters(nodes=1502)).meridians == 39
    assert network_of(SurfaceParameters(nodes=5)).size == 11
    chosen = network_of(SurfaceParameters(meridians=20, parallels=7))
    assert (chosen.meridians, chosen.parallels, chosen.size) == (20, 7, 142)


@pytest.mark.parametrize("thinning", [0.0, 0.5, 1.0])
def test_samples_lie_on_the_ellipsoid_poles_on_its_longest_axis(thinning):
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    axes *= np.linalg.det(axes)
    ellipsoid = Ellipsoid(np.array([0.1, 0.2, 0.3]), axes, np.array([0.05, 0.03, 0.02]))
    network = build_network(24, 17)
    points = sample_ellipsoid(ellipsoid, network, thinning)
    np.testing.assert_allclose(ellipsoid.level(points), 1.0)
    np.testing.assert_allclose(points[0] - points[-1], 2 * 0.05 * axes[:, 0], atol=1e-12)
    volume, centroid = enclosed_solid(points, network)
    assert volume == pytest.approx(ellipsoid.volume_m3, rel=0.05)  # outward faces: positive
    np.testing.assert_allclose(centroid, ellipsoid.centre, atol=1e-12)


def test_thinning_spreads_the_parallels_at_the_poles():
    network = build_network(8, 15)
    unit = Ellipsoid(np.zeros(3), np.eye(3), np.ones(3))
    polar = [np.arccos(sample_ellipsoid(unit, network, w)[1:-1:8, 0]) for w in (0.0, 1.0)]
    np.testing.assert_allclose(np.diff(polar[0]), np.pi / 16)
    np.testing.assert_allclose(np.diff(np.cos(polar[1])), -2 / 16)
