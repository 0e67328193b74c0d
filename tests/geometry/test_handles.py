import numpy as np
import pytest

from graspbench.geometry import topology
from graspbench.geometry.handles import cut_open, thinnest_loop
from tests.geometry.bad_meshes import torus


@pytest.mark.parametrize(("handles", "left"), [(1, 0), (2, 1), (3, 2)])
def test_the_thinnest_loop_goes_around_the_tube_and_its_cut_removes_one_handle(handles, left):
    body = torus(handles)
    vertices, faces = topology.weld(np.array(body.vertices), np.array(body.faces))
    loop, girth = thinnest_loop(vertices, faces)
    assert girth == pytest.approx(24 * 0.008 * np.sin(np.pi / 12), rel=1e-3)  # a regular polygon of 12 sides
    assert len(loop) == 12
    opened, cut = cut_open(vertices, faces, loop)
    edges = topology.find_edges(cut, len(opened))
    assert np.sum(edges.count == 1) == 24
    # Two discs close it: each adds a vertex, and a triangle for each edge of its rim.
    assert topology.genus(len(opened) + 2, len(cut) + 24) == left
