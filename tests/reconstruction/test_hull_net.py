from dataclasses import replace

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.geometry.intersections import self_intersections
from graspbench.reconstruction import SurfaceParameters, VisualHull, reconstruct
from graspbench.reconstruction.carrying import carry_over
from graspbench.reconstruction.dual_net import extract_net, sheets
from graspbench.reconstruction.methods import hull_net
from graspbench.reconstruction.narrow_band import BYTES_PER_CELL, CORNERS, NarrowBand, carve
from graspbench.reconstruction.network import quad_network
from tests.oracles.scenes import scene

NET = SurfaceParameters(method="hull_net", cell_px=2.0, nodes=102)
GENERA = {"sphere": 0, "egg": 0, "angle": 0, "torus": 1, "cup": 1, "plate": 2}


def rest(silhouettes, parameters=NET):
    *_, last = reconstruct(silhouettes, parameters)
    return last


def assert_closed_manifold(faces, size):
    """Each directed edge once, with its reverse, and one fan of faces around each node."""
    edges = [(int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    around = [{} for _ in range(size)]
    for face in faces:
        for k in range(len(face)):
            around[face[k]][int(face[k - 1])] = int(face[(k + 1) % len(face)])
    for following in around:
        start = here = next(iter(following))
        for _ in following:
            here = following[here]
        assert here == start
        seen = {start}
        while (here := following[here]) != start:
            seen.add(here)
        assert len(seen) == len(following)


def dense_band(values):
    """Return the band of a grid whose corners are all known."""
    inside = values < 0.0
    shape = np.array(values.shape) - 1
    signs = np.zeros(shape, dtype=np.int64)
    for bit, (i, j, k) in enumerate(CORNERS):
        signs |= inside[i : i + shape[0], j : j + shape[1], k : k + shape[2]].astype(np.int64) << bit
    cells = np.argwhere((signs > 0) & (signs < 255))
    slots = np.full(shape, -1, dtype=np.int32)
    slots[tuple(cells.T)] = np.arange(len(cells))
    return NarrowBand(np.zeros(3), 1.0, values, cells, signs[tuple(cells.T)], slots)


@pytest.mark.parametrize("name", GENERA)
def test_the_net_has_the_objects_genus_and_lies_on_the_hull(name):
    shapes = scene(name)
    surface = rest(shapes.silhouettes)
    network = surface.network
    assert network.genus == GENERA[name]
    assert_closed_manifold(network.faces, network.size)
    hull = VisualHull(shapes.silhouettes)
    distances = np.abs(hull.signed_distance(surface.points))
    assert distances.mean() < 0.05e-3
    assert np.quantile(distances, 0.99) < 0.5e-3
    outside = surface.points + 1e-3 * surface.normals
    assert np.mean(hull.signed_distance(outside) > 0.0) > 0.97


def test_edges_and_corners_are_kept():
    shapes = scene("angle")
    surface = rest(shapes.silhouettes, replace(NET, cell_px=1.5))
    middles = surface.points[surface.network.faces].mean(axis=1)
    gaps = np.abs(VisualHull(shapes.silhouettes).signed_distance(middles))
    assert gaps.mean() < 0.12e-3
    assert not self_intersections(surface.points, surface.network.faces).any()


def test_snapshots_end_at_rest_and_are_finer_and_finer():
    surfaces = list(reconstruct(scene("torus").silhouettes, NET))
    assert [surface.at_rest for surface in surfaces] == [False, False, False, True]
    sizes = [len(surface.points) for surface in surfaces[1:]]
    assert sizes[0] < 0.5 * sizes[1] < 0.25 * sizes[2]
    hull = VisualHull(scene("torus").silhouettes)
    assert hull.signed_distance(surfaces[0].points).min() > 0.0


def test_cells_coarser_than_a_thin_object_are_passed_over():
    silhouettes = scene("plate").silhouettes
    coarse = replace(NET, levels=5, cell_px=4.0)
    sizes = [len(surface.points) for surface in reconstruct(silhouettes, coarse)]
    assert 2 <= len(sizes) < 1 + coarse.levels
    last = rest(silhouettes, coarse)
    np.testing.assert_array_equal(last.points, rest(silhouettes, replace(coarse, levels=1)).points)


def test_the_same_images_give_the_same_net():
    first, second = (rest(scene("cup").silhouettes) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.network.faces, second.network.faces)


def test_auto_takes_the_net_only_where_a_silhouette_has_a_hole():
    auto = replace(NET, method="auto")
    assert rest(scene("torus").silhouettes, auto).network.genus == 1
    elastic = rest(scene("sphere").silhouettes, replace(NET, method="elastic"))
    np.testing.assert_array_equal(rest(scene("sphere").silhouettes, auto).points, elastic.points)


@pytest.mark.parametrize("method", ["elastic", "radial"])
def test_sphere_like_surfaces_close_holes(method):
    surface = rest(scene("torus").silhouettes, replace(NET, method=method))
    assert surface.network.genus == 0
    assert np.linalg.norm(surface.centroid[:2]) < 3e-3
    assert np.hypot(*surface.points[:, :2].T).min() < 0.02  # over the hole


@pytest.mark.parametrize("seed", range(40))
def test_any_field_gives_a_closed_manifold(seed):
    generator = np.random.default_rng(seed)
    values = np.full((9, 8, 10), 1.0, dtype=np.float32)
    values[1:-1, 1:-1, 1:-1] = generator.uniform(-1.0, 0.3 + 0.05 * seed, (7, 6, 8))
    hull = VisualHull(scene("sphere").silhouettes)
    net = extract_net(hull.fields, dense_band(values))
    assert_closed_manifold(net.quads, len(net.points))


def test_carving_finds_the_cells_that_a_dense_grid_finds():
    shapes = scene("cup")
    hull = VisualHull(shapes.silhouettes)
    low, high = shapes.mesh.bounds + 0.01 * np.array([[-1], [1]])
    band = carve(hull.fields, low, high, 3e-3)
    corners = band.low + band.side_m * np.stack(
        np.meshgrid(*(np.arange(n) for n in band.values.shape), indexing="ij"), axis=-1
    )
    exact = hull.signed_distance(corners.reshape(-1, 3)).reshape(band.values.shape).astype(np.float32)
    dense = dense_band(exact)
    assert set(map(tuple, band.cells.tolist())) == set(map(tuple, dense.cells.tolist()))
    known = ~np.isnan(band.values)
    np.testing.assert_array_equal(band.values[known] < 0, exact[known] < 0)


def test_sheets_of_known_cells():
    table = sheets()
    assert table.counts[[0, 255, 1, 254]].tolist() == [0, 0, 1, 1]
    both_ends = 1 | 1 << 7
    assert table.counts[both_ends] == 2
    assert table.counts[255 - both_ends] == 2
    crosswise = 1 | 1 << 3
    assert table.counts[crosswise] == 2
    for signs in range(256):
        cut = table.of_edge[signs][table.of_edge[signs] >= 0]
        assert set(cut.tolist()) == set(range(int(table.counts[signs])))


def test_contours_run_around_their_nodes():
    surface = rest(scene("cup").silhouettes)
    network = surface.network
    sides = set()
    for a in range(network.size):
        links = network.link_nodes[network.link_start[a] : network.link_start[a + 1]]
        sides |= {(a, int(b)) for b in links}
    assert {(b, a) for a, b in sides} == sides
    turning = []
    for a in range(0, network.size, 7):
        ring = network.contour(a)
        assert len(set(ring.tolist())) == len(ring)
        assert all((int(b), int(c)) in sides for b, c in zip(ring, np.roll(ring, -1), strict=True))
        arms = surface.points[ring] - surface.points[a]
        turning.append(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0) @ surface.normals[a])
    assert np.mean(np.array(turning) > 0) > 0.99


def test_a_square_torus_of_quads_has_rings_of_eight():
    n = 5
    node = lambda i, j: (i % n) * n + j % n  # noqa: E731
    quads = np.array(
        [[node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)] for i in range(n) for j in range(n)]
    )
    faces = np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]))
    network = quad_network(quads, faces, n * n)
    assert network.genus == 1
    ring = network.contour(node(2, 2)).tolist()
    wanted = [(3, 2), (3, 3), (2, 3), (1, 3), (1, 2), (1, 1), (2, 1), (3, 1)]
    at = ring.index(node(3, 2))
    assert ring[at:] + ring[:at] == [node(*place) for place in wanted]


def test_contacts_are_carried_to_the_nearest_node_of_the_same_side():
    surfaces = list(reconstruct(scene("torus").silhouettes, NET))
    coarse, fine = surfaces[-2], surfaces[-1]
    contacts = np.array([0, len(coarse.points) // 2, len(coarse.points) - 1])
    assert carry_over(contacts, coarse, coarse) is contacts
    carried = carry_over(contacts, coarse, fine)
    assert np.linalg.norm(fine.points[carried] - coarse.points[contacts], axis=1).max() < 6e-3
    assert np.einsum("ij,ij->i", fine.normals[carried], coarse.normals[contacts]).min() > 0.8
    near = np.array([0, *coarse.network.contour(0)[:5]])
    back = carry_over(carry_over(near, coarse, surfaces[1]), surfaces[1], coarse)
    assert len(set(back.tolist())) == len(near)


def test_a_slope_is_the_fields_own():
    from graspbench.compiled import compiled
    from graspbench.reconstruction.hull_fields import view_distance, view_slope

    @compiled
    def slope(fields, view, x, y, z):
        return view_slope(fields, view, x, y, z)

    @compiled
    def distance(fields, view, x, y, z):
        return view_distance(fields, view, x, y, z)

    shapes = scene("cup")
    fields = VisualHull(shapes.silhouettes).fields
    generator = np.random.default_rng(3)
    close = 0
    for point in generator.uniform(*(shapes.mesh.bounds + 0.02 * np.array([[-1], [1]])), (200, 3)):
        view = int(generator.integers(len(shapes.silhouettes) + 1))
        value, *direction = slope(fields, view, *point)
        assert value == pytest.approx(distance(fields, view, *point), abs=1e-12)
        step = 1e-7
        numeric = np.array(
            [
                distance(fields, view, *(point + step * axis))
                - distance(fields, view, *(point - step * axis))
                for axis in np.eye(3)
            ]
        )
        close += np.allclose(direction, numeric / np.linalg.norm(numeric), atol=1e-4)
    assert close >= 198  # a step may cross into the next pixel


@pytest.mark.parametrize("name", ["cup", "angle"])
def test_views_that_are_not_looked_at_again_change_nothing(name):
    from graspbench.compiled import compiled
    from graspbench.reconstruction.hull_fields import critical_view, critical_view_near, unseen

    @compiled
    def along(fields, points, near, all_views):
        seen = unseen(fields)
        for k in range(len(points)):
            near[k] = critical_view_near(fields, points[k, 0], points[k, 1], points[k, 2], seen)[1]
            all_views[k] = critical_view(fields, points[k, 0], points[k, 1], points[k, 2])[1]

    shapes = scene(name)
    fields = VisualHull(shapes.silhouettes).fields
    generator = np.random.default_rng(5)
    low, high = shapes.mesh.bounds
    # A walk in steps from a tenth of a millimetre to a centimetre, and jumps now and then.
    steps = generator.normal(size=(4000, 3)) * 10.0 ** generator.uniform(-4, -2, (4000, 1))
    points = low + (high - low) * np.abs((steps.cumsum(axis=0) / (high - low) + 1.0) % 2.0 - 1.0)
    points[::500] = generator.uniform(low, high, (8, 3))
    near, every = np.empty(len(points)), np.empty(len(points))
    along(fields, points, near, every)
    np.testing.assert_array_equal(near, every)


@pytest.mark.parametrize(
    ("limit", "most", "said"), [("MAX_CELLS", 4000, "cells and .* GB"), ("MAX_NODES", 800, "nodes")]
)
def test_cells_too_fine_for_memory_or_planner_are_refused_with_the_size_that_will_do(
    monkeypatch, limit, most, said
):
    silhouettes = scene("torus").silhouettes
    monkeypatch.setattr(hull_net, limit, most)
    with pytest.raises(ConfigurationError, match=rf"surface\.cell_px = 2 makes .*{said}") as caught:
        rest(silhouettes)
    enough = float(caught.value.remedy.split()[-1])
    assert 2.0 < enough < 10.0
    rest(silhouettes, replace(NET, cell_px=enough, levels=1))


def test_no_images_lead_to_a_grid_of_more_than_four_gigabytes():
    assert hull_net.MAX_CELLS * BYTES_PER_CELL <= 2**32
    far = np.array([20.0, 20.0, 20.0])  # seen in images of any size
    with pytest.raises(ConfigurationError, match="GB"):
        hull_net.check_grid(-far, far, 0.01, NET)
