import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from graspbench.errors import StationError
from graspbench.perception import Camera, CameraParameters, Silhouette, look_at, triangulate_centre
from graspbench.perception.triangulation import meet_rays

INTRINSICS = CameraParameters().intrinsics


def seen_at(point, position, target):
    camera = Camera(INTRINSICS, look_at(position, target))
    empty = np.zeros((480, 640), bool)
    centroid = camera.project(point[None])[0]
    return Silhouette("any", empty, (0, 0, 0, 0), centroid, camera, (0, 0, 0, 0), empty.astype(np.float32))


@given(st.tuples(*[st.floats(-0.1, 0.1)] * 3).map(np.array), st.integers(2, 9), st.integers(0, 99))
def test_exact_centroids_give_the_point_back(point, count, seed):
    positions = np.random.default_rng(seed).normal(size=(count, 3)) * 0.2 + (0.0, 0.0, 1.0)
    views = [seen_at(point, position, np.zeros(3)) for position in positions]
    np.testing.assert_allclose(triangulate_centre(views), point, atol=1e-7)


def test_the_point_has_the_least_sum_of_squared_distances():
    generator = np.random.default_rng(3)
    origins, directions = generator.normal(size=(6, 3)), generator.normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)

    def cost(x):
        return np.sum(np.cross(x - origins, directions) ** 2)

    best = minimize(cost, np.zeros(3), tol=1e-12).x
    np.testing.assert_allclose(meet_rays(origins, directions), best, atol=1e-5)


def test_a_rigid_motion_moves_the_point_alike():
    from scipy.spatial.transform import Rotation

    generator = np.random.default_rng(4)
    origins, directions = generator.normal(size=(5, 3)), generator.normal(size=(5, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    turn, shift = Rotation.random(rng=generator).as_matrix(), generator.normal(size=3)
    moved = meet_rays(origins @ turn.T + shift, directions @ turn.T)
    np.testing.assert_allclose(moved, turn @ meet_rays(origins, directions) + shift, atol=1e-9)


@pytest.mark.parametrize("count", [1, 4])
def test_parallel_rays_are_refused(count):
    with pytest.raises(StationError, match="one direction"):
        meet_rays(np.random.default_rng(0).normal(size=(count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1)))
