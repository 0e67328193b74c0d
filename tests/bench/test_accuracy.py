"""The benchmark's yardsticks against closed forms."""

import numpy as np
import pytest
import trimesh

from graspbench.bench.accuracy import build_reference, filled_cells, measure, measure_hull
from graspbench.bench.voxels import carve_masks, surface_net, tight_box
from tests.oracles.scenes import scene


def test_filled_cells_are_those_inside():
    angle = scene("angle").mesh
    low, counts = angle.bounds[0] - 0.01, np.array([60, 60, 30])
    cells = filled_cells(angle.vertices, angle.faces, low, 2e-3, counts)
    centres = low + 2e-3 * (np.argwhere(np.ones(counts, dtype=bool)) + 0.5)
    inside = np.zeros(len(centres), dtype=bool)
    for size, middle in (((0.02, 0.1, 0.02), (0, 0.05, 0.01)), ((0.07, 0.02, 0.03), (0.035, 0, 0.015))):
        inside |= (np.abs(centres - middle) <= np.array(size) / 2).all(axis=1)
    assert inside.sum() > 1000
    # The two arms were moved down together: their common lower side is at z = 0.
    assert np.mean(cells.ravel() == inside) > 0.995


def test_surface_net_of_a_voxel_ball_is_closed_and_near_the_ball():
    box = tight_box(np.array([-0.04, -0.04, 0.01]), np.array([0.04, 0.04, 0.09]), 40)
    centres = box.low + box.side_m * (np.argwhere(np.ones((40, 40, 40), dtype=bool)) + 0.5)
    ball = (np.linalg.norm(centres - [0, 0, 0.05], axis=1) < 0.035).reshape(40, 40, 40)
    vertices, faces = surface_net(ball, box)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.035**3, rel=0.02)  # outward faces: positive
    distances = np.abs(np.linalg.norm(vertices - [0, 0, 0.05], axis=1) - 0.035)
    assert distances.max() < box.side_m


def test_carved_voxels_are_those_whose_centre_all_silhouettes_hold():
    shapes = scene("egg")
    box = tight_box(*shapes.mesh.bounds, 24)
    centres = box.low + box.side_m * (np.argwhere(np.ones((24, 24, 24), dtype=bool)) + 0.5)
    held = np.ones(len(centres), dtype=bool)
    for silhouette in shapes.silhouettes:
        u, v = np.floor(silhouette.camera.project(centres)).astype(int).T
        held &= silhouette.mask[v, u]
    np.testing.assert_array_equal(carve_masks(shapes.silhouettes, box).ravel(), held)


def test_a_ball_is_measured_right():
    shapes = scene("sphere")
    cameras = [silhouette.camera for silhouette in shapes.silhouettes]
    reference = build_reference(
        shapes.mesh.vertices, shapes.mesh.faces, cameras, shapes.silhouettes, spacing_m=1.5e-3
    )
    exact = measure(shapes.mesh.vertices, shapes.mesh.faces, reference)
    assert exact.object_hausdorff_m < 0.02e-3
    assert exact.iou == 1.0
    limit = measure_hull(reference)
    assert limit.hull_mean_m == 0.0
    assert limit.object_mean_m == pytest.approx(exact.hull_mean_m, rel=0.3)
    # A ball 2 mm larger is 2 mm away everywhere, and its volume shrinks by the ratio's cube.
    larger = shapes.centre + (shapes.mesh.vertices - shapes.centre) * 1.05
    grown = measure(larger, shapes.mesh.faces, reference)
    assert grown.object_mean_m == pytest.approx(2e-3, rel=0.02)
    assert grown.object_hausdorff_m == pytest.approx(2e-3, rel=0.02)
    assert grown.iou == pytest.approx(1.05**-3, abs=0.01)
