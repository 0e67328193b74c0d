import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from graspbench.geometry import topology
from graspbench.geometry.star_surface import cube_sphere


def torus(m=7, n=5, handles=1):
    i, j = np.meshgrid(np.arange(m), np.arange(n), indexing="ij")
    corner = (i * n + j).ravel()
    right = (((i + 1) % m) * n + j).ravel()
    up = (i * n + (j + 1) % n).ravel()
    both = (((i + 1) % m) * n + (j + 1) % n).ravel()
    return m * n, np.concatenate([np.stack([corner, right, both], 1), np.stack([corner, both, up], 1)])


def test_genus_of_sphere_and_torus():
    points, faces = cube_sphere(3)
    assert topology.genus(len(points), len(faces)) == 0
    assert topology.genus(*(torus()[0], len(torus()[1]))) == 1


def test_weld_joins_a_soup_of_triangles_and_drops_what_has_no_area():
    points, faces = cube_sphere(4)
    soup = points[faces].reshape(-1, 3)
    loose = np.arange(len(soup)).reshape(-1, 3)
    extra = np.concatenate([loose, loose[:2], [[0, 0, 1]]])  # two duplicates and a needle
    welded, triangles = topology.weld(soup, extra)
    assert (len(welded), len(triangles)) == (len(points), len(faces))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.45))
def test_turned_triangles_are_turned_back(seed, share):
    rng = np.random.default_rng(seed)
    points, faces = cube_sphere(4)
    turned = rng.random(len(faces)) < share
    assume(turned.sum() < 0.5 * len(faces))  # the side that most of them have is the outer one
    mixed = np.where(turned[:, None], faces[:, ::-1], faces)
    result = topology.orient(mixed, topology.find_edges(mixed, len(points)))
    assert result is not None
    agree = topology.find_edges(result[0], len(points))
    assert not agree.same_way.any()
    np.testing.assert_array_equal(result[0], faces)
    assert result[1] == turned.sum()


def test_a_moebius_strip_has_one_side():
    n = 8
    faces = []
    for i in range(n):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i < n - 1 else (1, 0)
        faces += [[a, c, b], [b, c, d]]
    faces = np.array(faces)
    assert topology.orient(faces, topology.find_edges(faces, 2 * n)) is None


def test_a_pinched_vertex_becomes_two():
    points, faces = cube_sphere(2)
    count = len(points)
    other = faces + count
    other[other == count] = 0  # both share vertex 0
    both = np.concatenate([faces, other])
    vertices = np.concatenate([points, points + 5.0])
    edges = topology.find_edges(both, len(vertices))
    split, triangles, pinched = topology.split_fans(vertices, both, edges)
    assert pinched == 1
    assert len(np.unique(triangles)) == 2 * count
    assert topology.bodies(triangles, edges).max() == 1
    np.testing.assert_array_equal(split[triangles], vertices[both])


@pytest.mark.parametrize("only_pairs", [False, True])
def test_bodies_that_share_an_edge(only_pairs):
    tetrahedron = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    other = np.array([[1, 0, 4], [0, 1, 5], [1, 4, 5], [4, 0, 5]])  # shares the edge 0-1
    faces = np.concatenate([tetrahedron, other])
    label = topology.bodies(faces, topology.find_edges(faces, 6), only_pairs=only_pairs)
    assert label.max() + 1 == (2 if only_pairs else 1)
