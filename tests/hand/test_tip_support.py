"""Where a link's real shape touches: closed forms, a brute-force search, and finite differences."""

import coal
import numpy as np
import pinocchio
import pytest
import trimesh

from graspbench.hand import load_hand
from graspbench.hand.tip_support import FINAL_SHARPNESS_M, C, H, support
from graspbench.hand.tip_surfaces import heights, shape_elements
from tests.hand.tip_hands import BOX, tip_hand

TAU = FINAL_SHARPNESS_M
POSE = pinocchio.SE3(pinocchio.rpy.rpyToMatrix(0.3, -0.7, 1.1), np.array([0.01, -0.02, 0.03]))
LEVEL = pinocchio.SE3.Identity()


@pytest.fixture(scope="module")
def chains(tmp_path_factory):
    return load_hand(tip_hand(tmp_path_factory.mktemp("tips"), BOX)).chains


def touched(chains, elements, direction, sharpness=TAU, frame=None):
    """Return where elements have an outward normal, its derivative, and the direction's unit vector."""
    d = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    own = chains._replace(elements=elements, spans=np.array([[0, len(elements)]]))
    out = np.zeros(12)
    support(own, 0, np.eye(3, 4) if frame is None else frame, *d, sharpness, out)
    return out[C : C + 3], out[H:].reshape(3, 3), d


def mesh(points):
    hull = trimesh.convex.convex_hull(np.asarray(points))
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(hull.faces), len(hull.vertices))
    shape.addVertices(np.asarray(hull.vertices))
    shape.addTriangles(np.asarray(hull.faces, dtype=np.uint32))
    shape.endModel()
    return shape, hull


def test_a_box_touches_with_the_corner_edge_or_face_that_comes_first(chains):
    elements = shape_elements(coal.Box(0.02, 0.03, 0.04), LEVEL)
    corner, _, _ = touched(chains, elements, [1, 2, -1])
    np.testing.assert_allclose(corner, [0.01, 0.015, -0.02], atol=1e-9)
    edge, _, d = touched(chains, elements, [1, 0, 1])
    np.testing.assert_allclose(edge, np.array([0.01, 0, 0.02]) + TAU * np.log(2) * d, atol=1e-9)
    face, _, d = touched(chains, elements, [0, -1, 0])
    np.testing.assert_allclose(face, np.array([0, -0.015, 0]) + TAU * np.log(4) * d, atol=1e-9)


def test_a_sphere_and_a_capsule_touch_a_radius_from_their_cores(chains):
    ball, slope, d = touched(chains, shape_elements(coal.Sphere(0.007), POSE), [1, -2, 0.5])
    np.testing.assert_allclose(ball, POSE.translation + 0.007 * d, atol=1e-9)
    np.testing.assert_allclose(
        slope @ (np.eye(3) - np.outer(d, d)), 0.007 * (np.eye(3) - np.outer(d, d)), atol=1e-9
    )
    capsule, _, d = touched(chains, shape_elements(coal.Capsule(0.006, 0.04), LEVEL), [1, 0.2, 0.4])
    np.testing.assert_allclose(capsule, np.array([0, 0, 0.02]) + 0.006 * d, atol=1e-9)
    side, _, d = touched(chains, shape_elements(coal.Capsule(0.006, 0.04), LEVEL), [0, 1, 0])
    np.testing.assert_allclose(side, (0.006 + TAU * np.log(2)) * d, atol=1e-9)


def test_a_cylinder_touches_with_its_rim_its_side_or_the_middle_of_its_end(chains):
    elements = shape_elements(coal.Cylinder(0.006, 0.04), LEVEL)
    rim, _, _ = touched(chains, elements, [3, 4, 5])
    np.testing.assert_allclose(rim, [0.0036, 0.0048, 0.02], atol=1e-8)
    side, _, d = touched(chains, elements, [0.6, 0.8, 0])
    np.testing.assert_allclose(side, (0.006 + TAU * np.log(2)) * d, atol=1e-8)
    end, _, _ = touched(chains, elements, [0, 0, -1])
    np.testing.assert_allclose(end, [0, 0, -0.02], atol=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_no_point_of_a_hull_reaches_farther(chains, seed):
    """By brute force: the points of a surface, sampled densely, and the distance from the real surface."""
    generator = np.random.default_rng(seed)
    shape, hull = mesh(generator.normal(size=(40, 3)) * [0.006, 0.008, 0.02])
    elements = shape_elements(shape, POSE)
    samples = np.vstack((hull.vertices, hull.sample(4000, seed=seed)))
    samples = samples @ POSE.rotation.T + POSE.translation
    body = hull.copy()
    body.apply_transform(POSE.homogeneous)
    for direction in generator.normal(size=(20, 3)):
        point, _, d = touched(chains, elements, direction)
        farthest = float((samples @ d).max())
        assert farthest <= point @ d + 1e-12
        assert point @ d <= farthest + TAU * np.log(len(elements))
        assert trimesh.proximity.closest_point_naive(body, point[None])[1][0] <= TAU * np.log(len(elements))
        assert heights(elements, d).max() == pytest.approx(farthest, abs=1e-9)


@pytest.mark.parametrize("sharpness", [1e-3, 1e-4])
def test_the_derivative_is_that_of_finite_differences(chains, sharpness):
    generator = np.random.default_rng(5)
    shape, _ = mesh(generator.normal(size=(30, 3)) * 0.01)
    shapes = (coal.Box(0.02, 0.03, 0.04), coal.Cylinder(0.006, 0.02), coal.Capsule(0.006, 0.02), shape)
    elements = np.concatenate([shape_elements(each, POSE) for each in shapes])
    frame = np.column_stack((pinocchio.rpy.rpyToMatrix(0.2, 0.5, -1.0), [0.1, 0.2, 0.3]))
    for direction in generator.normal(size=(15, 3)):
        _, slope, d = touched(chains, elements, direction, sharpness, frame)
        across = np.linalg.svd(d[None])[2][1:]
        for turn in across:
            step = 1e-6
            ahead, behind = (
                touched(chains, elements, d + sign * step * turn, sharpness, frame)[0] for sign in (1, -1)
            )
            moved = frame[:, :3] @ (ahead - behind) / (2 * step)
            np.testing.assert_allclose(slope @ turn, moved, atol=1e-6 + 1e-4 * np.abs(moved).max())
