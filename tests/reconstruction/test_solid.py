import numpy as np
import pytest
import trimesh

from graspbench.reconstruction import build_network, enclosed_solid, vertex_normals
from graspbench.reconstruction.ellipsoid import Ellipsoid
from graspbench.reconstruction.sampling import sample_ellipsoid


def _ellipsoid(semi_axes, meridians=30, parallels=31):
    network = build_network(meridians, parallels)
    ellipsoid = Ellipsoid(np.array([1.0, -2.0, 0.5]), np.eye(3), np.array(semi_axes))
    return ellipsoid, network, sample_ellipsoid(ellipsoid, network, 0.5)


def test_solid_agrees_with_trimesh():
    _, network, points = _ellipsoid([0.06, 0.05, 0.02])
    points = points + 0.002 * np.random.default_rng(0).normal(size=points.shape)
    volume, centroid = enclosed_solid(points, network)
    mesh = trimesh.Trimesh(points, network.faces, process=False)
    assert volume == pytest.approx(mesh.volume)
    np.testing.assert_allclose(centroid, mesh.center_mass)


def test_normals_are_exact_on_a_sphere_poles_included():
    ellipsoid, network, points = _ellipsoid([0.05, 0.05, 0.05])
    normals = vertex_normals(points, network)
    np.testing.assert_allclose(normals, (points - ellipsoid.centre) / 0.05, atol=1e-9)


@pytest.mark.parametrize("smoothing", [0, 1, 3])
def test_normals_are_close_on_an_ellipsoid_poles_included(smoothing):
    ellipsoid, network, points = _ellipsoid([0.06, 0.04, 0.03])
    exact = (points - ellipsoid.centre) / ellipsoid.semi_axes**2
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    normals = vertex_normals(points, network, smoothing=smoothing)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    angles = np.degrees(np.arccos(np.clip((normals * exact).sum(axis=1), -1, 1)))
    assert angles.max() < 3.0 + 0.3 * smoothing
    assert angles[[0, -1]].max() < 0.6


def test_smoothing_calms_the_normals_of_a_rough_surface():
    ellipsoid, network, points = _ellipsoid([0.05, 0.05, 0.05])
    exact = (points - ellipsoid.centre) / 0.05
    rough = points + 0.0003 * np.random.default_rng(1).normal(size=points.shape)
    errors = [
        np.mean(1 - (vertex_normals(rough, network, smoothing=k) * exact).sum(axis=1)) for k in (0, 1, 3)
    ]
    assert errors[2] < errors[1] < 0.5 * errors[0]
