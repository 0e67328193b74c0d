"""The renderer against projective geometry."""

import itertools

import numpy as np
import pytest

from graspbench.reconstruction.network import build_network
from graspbench.report.render import Viewpoint, render
from graspbench.report.solids import ball, mesh_solid, network_edges, tube

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


@pytest.fixture
def view():
    return Viewpoint(np.zeros(3), azimuth_deg=0.0, elevation_deg=0.0, radius_m=1.0)


def is_red(pixel):
    return pixel[0] > pixel[2] + 60


def is_blue(pixel):
    return pixel[2] > pixel[0] + 60


def test_ball_appears_with_its_angular_radius(view):
    radius = 0.4
    image = render([ball(np.zeros(3), radius, RED)], [], view, (201, 201))
    width = (image[100, :, 1] < 250).sum() / 201
    angle = np.arcsin(radius / view.distance_m)
    assert width == pytest.approx(np.tan(angle) / np.tan(np.radians(view.field_deg / 2)), abs=0.02)


def test_axes_are_right_handed_and_upright(view):
    # The eye is on the x axis: y is to the right, z up.
    pixels = view.project(np.array([[0, 0.3, 0], [0, 0, 0.3]]), 200, 200)
    assert pixels[0, 0] > 100
    assert pixels[0, 1] == pytest.approx(100)
    assert pixels[1, 1] < 100
    np.testing.assert_allclose(np.cross(view.axes[0], view.axes[1]), view.axes[2], atol=1e-12)


def test_nearer_body_hides_the_farther_whatever_the_order(view):
    near, far = ball(np.array([0.5, 0, 0]), 0.2, RED), ball(np.array([-0.5, 0, 0]), 0.2, BLUE)
    for solids in ([near, far], [far, near]):
        assert is_red(render(solids, [], view, (101, 101))[50, 50])


def test_hidden_mark_shines_through_faintly(view):
    body = ball(np.zeros(3), 0.5, BLUE)
    hidden = ball(np.array([-0.8, 0, 0]), 0.1, RED)
    plain = render([body], [], view, (101, 101))[50, 50].astype(int)
    seen = render([body], [hidden], view, (101, 101))[50, 50].astype(int)
    full = render([], [hidden], view, (101, 101))[50, 50].astype(int)
    assert plain[0] < seen[0] < full[0]


def test_mark_in_front_is_not_mixed(view):
    mark = ball(np.array([0.8, 0, 0]), 0.1, RED)
    alone = render([], [mark], view, (101, 101))[50, 50]
    np.testing.assert_array_equal(
        render([ball(np.zeros(3), 0.5, BLUE)], [mark], view, (101, 101))[50, 50], alone
    )


def test_shadow_darkens_the_table_only_near_the_body():
    view = Viewpoint(np.zeros(3), 0.0, 30.0, 1.0)
    image = render([ball(np.array([0, 0, 0.2]), 0.2, BLUE)], [], view, (200, 200), ground_height_m=0.0)
    grey = (image.max(axis=2) == image.min(axis=2)) & (image[..., 0] < 245)
    assert grey.sum() > 200
    assert image[5, 5].tolist() == [255, 255, 255]


def test_tube_has_its_radius_all_along_a_bent_line():
    line = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1.0]])
    dense = np.concatenate([np.linspace(a, b, 40) for a, b in itertools.pairwise(line)])
    solid = tube(dense, 0.01, RED)
    gaps = np.linalg.norm(solid.points[:, None] - dense[None], axis=-1).min(axis=1)
    np.testing.assert_allclose(gaps, 0.01, atol=2e-3)


def test_tube_of_one_place_is_a_ball():
    solid = tube(np.zeros((5, 3)), 0.01, RED)
    np.testing.assert_allclose(np.linalg.norm(solid.points, axis=1), 0.01)


def test_network_edges_are_all_springs_and_no_diagonal():
    network = build_network(7, 5)
    drawn = network_edges(network)
    faces = network.faces
    pairs = {
        frozenset((int(f[(k + 1) % 3]), int(f[(k + 2) % 3])))
        for f, e in zip(faces, drawn, strict=True)
        for k in range(3)
        if e[k]
    }
    springs = {
        frozenset((a, int(b)))
        for a in range(network.size)
        for b in network.link_nodes[network.link_start[a] : network.link_start[a + 1]]
    }
    assert pairs == springs


def test_flat_mesh_keeps_its_faces_normals():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    solid = mesh_solid(points, np.array([[0, 1, 2]]), RED)
    np.testing.assert_allclose(solid.normals, [[0, 0, 1]] * 3)
