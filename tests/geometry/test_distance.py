import numpy as np
import pytest
import trimesh

from graspbench.geometry.distance import distances_to_mesh


def test_distance_to_a_box_inside_and_outside():
    box = trimesh.creation.box((2.0, 4.0, 6.0))
    points = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, 6.0, 0.0], [2.0, 3.0, 4.0], [0.9, 0.0, 0.0]])
    expected = [1.0, 2.0, 5.0, np.sqrt(3.0), 0.1]
    assert distances_to_mesh(points, box) == pytest.approx(expected, abs=1e-9)


def test_distance_agrees_with_a_dense_sample_of_the_surface():
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    points = np.random.default_rng(0).uniform(-2, 2, (50, 3))
    sample, _ = trimesh.sample.sample_surface(mesh, 200_000, seed=0)
    brute = np.array([np.linalg.norm(sample - point, axis=1).min() for point in points])
    assert np.abs(distances_to_mesh(points, mesh) - brute).max() < 0.01
