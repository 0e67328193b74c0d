import numpy as np
import trimesh
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from graspbench.hand import collision
from graspbench.hand.borders import cuts_hull, lowest_point, sided_distance
from graspbench.hand.directions import even_directions
from graspbench.hand.hulls import hull_of, stacked
from graspbench.hand.shapes import Shapes

CALL_LOWEST, CALL_DISTANCE, CALL_CUTS = lowest_point.py_func, sided_distance.py_func, cuts_hull.py_func


def cloud(seed: int, count: int = 300) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return generator.standard_normal((count, 3)) * generator.uniform(0.004, 0.02, 3)


def shapes_of(vertices: np.ndarray) -> Shapes:
    nothing = np.zeros((0, 3))
    return Shapes(
        index=np.array([[0, 0, 1, 0]]),
        local=nothing,
        size=np.array([[0.01, 0.01, 0.01, 0.0, 0.02]]),
        pairs=np.zeros((0, 2), dtype=np.int64),
        **stacked([hull_of(vertices)]),
    )


def pose_of(seed: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return np.column_stack((Rotation.random(rng=generator).as_matrix(), generator.uniform(-0.1, 0.1, 3)))


def test_hull_lies_between_its_corners_and_its_planes():
    for seed in range(5):
        vertices = cloud(seed, 60)
        hull = hull_of(vertices)
        assert np.max(vertices @ hull.planes[:, :3].T - hull.planes[:, 3]) <= 1e-12
        directions = even_directions(400)
        missing = (directions @ vertices.T).max(axis=1) - (directions @ hull.corners.T).max(axis=1)
        assert np.abs(missing).max() <= 1e-12


def test_many_corners_are_thinned_to_a_tenth_of_a_millimetre():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.01).vertices
    hull, directions = hull_of(ball), even_directions(300)
    missing = (directions @ ball.T).max(axis=1) - (directions @ hull.corners.T).max(axis=1)
    assert len(hull.corners) <= 500 < len(ball)
    assert -1e-12 <= missing.min() <= missing.max() <= 1e-4


def test_boxes_facets_are_among_the_planes():
    hull = hull_of(trimesh.creation.box((0.02, 0.03, 0.05)).vertices)
    for axis, half in enumerate((0.01, 0.015, 0.025)):
        for sign in (-1.0, 1.0):
            normal = sign * np.eye(3)[axis]
            assert np.any(np.linalg.norm(hull.planes - [*normal, half], axis=1) < 1e-9)


def test_flat_meshes_have_no_hull():
    assert hull_of(np.random.default_rng(0).uniform(size=(20, 3)) * [1.0, 1.0, 0.0]) is None


def test_lowest_point_is_the_extreme_corner():
    vertices, pose = cloud(1), pose_of(2)
    shapes, placed = shapes_of(vertices), vertices @ pose[:, :3].T + pose[:, 3]
    for direction in even_directions(40):
        found = np.array(CALL_LOWEST(shapes, 0, pose, *direction))
        assert abs(found @ direction - (placed @ direction).min()) <= 1e-9
        assert np.min(np.linalg.norm(placed - found, axis=1)) < 1e-12


def test_sided_distance_is_a_lower_bound_that_knows_inside_from_outside():
    vertices, pose = cloud(3), pose_of(4)
    shapes = shapes_of(vertices)
    placed = vertices @ pose[:, :3].T + pose[:, 3]
    hull = ConvexHull(placed)
    surface = trimesh.sample.sample_surface(trimesh.Trimesh(placed, hull.simplices), 5000, seed=0)[0]
    for point in pose[:, 3] + np.random.default_rng(5).uniform(-0.04, 0.04, (200, 3)):
        distance, *out = CALL_DISTANCE(shapes, 0, pose, *point)
        assert abs(np.linalg.norm(out) - 1.0) < 1e-9
        outside = (hull.equations[:, :3] @ point + hull.equations[:, 3]).max() > 0.0
        assert outside or distance <= 1e-9
        if outside:
            assert distance <= np.linalg.norm(surface - point, axis=1).min()
        # The shift by the distance along the way out ends on the plane that was nearest.
        moved = CALL_DISTANCE(shapes, 0, pose, *(point - distance * np.array(out)))[0]
        assert moved >= -1e-9


def test_triangles_cut_a_hull_where_they_reach_inside_all_planes():
    vertices, pose = trimesh.creation.box((0.02, 0.02, 0.02)).vertices, pose_of(6)
    shapes = shapes_of(vertices)
    work = np.zeros((2, 3 + len(shapes.planes), 3))
    flat = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.5, 0.0]])
    for height, cut in ((0.0099, True), (0.0101, False), (0.00995, False), (0.0, True), (-0.0101, False)):
        triangle = (flat + np.array([0.0, 0.0, height])) @ pose[:, :3].T + pose[:, 3]
        depth = 9e-5 if height != 0.0 else 0.0
        assert CALL_CUTS(shapes, 0, pose, depth, triangle, work) is cut


def test_end_of_a_link_is_what_is_near_its_contact(monkeypatch):
    monkeypatch.setattr(collision, "sided_distance", CALL_DISTANCE)
    monkeypatch.setattr(collision, "lowest_point", CALL_LOWEST)
    half, radius = np.array([0.01, 0.008, 0.05]), 0.02
    shapes, pose = shapes_of(trimesh.creation.box(2 * half).vertices), pose_of(7)
    for seed in range(40):
        generator = np.random.default_rng(seed)
        contact = np.array([0.011, *generator.uniform(-1.0, 1.0, 2) * half[1:]])
        normal = np.array([1.0, *generator.uniform(-0.5, 0.5, 2)])
        normal = pose[:, :3] @ (-normal / np.linalg.norm(normal))
        contact = pose[:, :3] @ contact + pose[:, 3]
        near, *point = collision.lowest_near.py_func(shapes, 0, pose, contact, radius, *normal)
        assert near
        assert np.linalg.norm(point - contact) <= radius + 1e-9
        local = pose[:, :3].T @ (point - pose[:, 3])
        assert np.all(np.abs(local) <= half + 1e-9)
        lowest = np.array(CALL_LOWEST(shapes, 0, pose, *normal))
        if np.linalg.norm(lowest - contact) < radius:
            np.testing.assert_allclose(point, lowest, atol=1e-12)
        else:
            assert abs(np.linalg.norm(point - contact) - radius) <= 1e-9
        # Not higher than the link's point that is nearest to the contact.
        distance, *out = CALL_DISTANCE(shapes, 0, pose, *contact)
        assert normal @ point <= normal @ (contact - distance * np.array(out)) + 1e-9


def test_links_far_from_a_contact_are_left_out(monkeypatch):
    monkeypatch.setattr(collision, "sided_distance", CALL_DISTANCE)
    shapes = shapes_of(trimesh.creation.box((0.02, 0.02, 0.02)).vertices)
    near, *_ = collision.lowest_near.py_func(
        shapes, 0, np.eye(4)[:3], np.array([0.05, 0.0, 0.0]), 0.02, -1.0, 0.0, 0.0
    )
    assert not near
