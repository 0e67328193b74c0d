from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from graspbench.bench.hull_reference import hull_border, triangle_cloud
from graspbench.errors import ReconstructionError
from graspbench.geometry.intersections import self_intersections
from graspbench.reconstruction import SurfaceParameters, VisualHull, reconstruct
from graspbench.reconstruction.border import sample_border
from graspbench.reconstruction.regulation import uncovered
from tests.oracles.rasterise import exact_silhouettes
from tests.oracles.scenes import scene


def hausdorff(a, b):
    """Return the two-sided Hausdorff distance of two covered surfaces (m)."""
    return max(a.distances_from(b.points).max(), b.distances_from(a.points).max())


CENTROID = SurfaceParameters(nodes=902)


@pytest.mark.parametrize("name", ["mushroom", "angle"])
def test_pull_along_normals_reaches_what_the_centroid_cannot_see(name):
    shapes = scene(name)
    reference = hull_border(VisualHull(shapes.silhouettes), *shapes.mesh.bounds, spacing_m=1e-3)
    crossed, gaps = {}, {}
    for pull in ("centroid", "normal"):
        *_, last = reconstruct(shapes.silhouettes, replace(CENTROID, pull=pull))
        assert last.at_rest
        gaps[pull] = hausdorff(triangle_cloud(last.points, last.network.faces, spacing_m=1e-3), reference)
        crossed[pull] = self_intersections(last.points, last.network.faces).any()
    assert gaps["normal"] < 0.8 * gaps["centroid"]
    assert not any(crossed.values())


def test_refinement_only_improves_from_snapshot_to_snapshot():
    shapes = scene("mushroom")
    surfaces = list(reconstruct(shapes.silhouettes, replace(CENTROID, pull="normal", refinement_steps=12)))
    hull = VisualHull(shapes.silhouettes)
    distances = [np.abs(hull.signed_distance(s.points)).mean() for s in surfaces]
    assert distances[-1] < 0.1e-3
    assert all(np.isfinite(s.points).all() for s in surfaces)


def test_border_samples_cover_the_largest_part_only():
    shapes = scene("egg")
    hull = VisualHull(shapes.silhouettes)
    points = sample_border(hull, *shapes.mesh.bounds, 2e-3)
    assert np.abs(hull.signed_distance(points)).max() < 0.1e-3
    gaps = KDTree(points).query(points, k=2)[0][:, 1]
    assert gaps.max() < 3e-3
    with pytest.raises(ReconstructionError, match="no point in common"):
        sample_border(hull, shapes.mesh.bounds[0] + 1.0, shapes.mesh.bounds[1] + 1.0, 5e-3)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=12, max_size=12))
def test_distance_to_a_triangle_is_that_of_a_dense_search(numbers):
    points = np.array(numbers).reshape(4, 3)
    corners, sample = points[:3], points[3:]
    worst, pulls = np.empty(3), np.empty((3, 3))
    start, faces_of = np.arange(4), np.zeros(3, dtype=np.int64)
    faces = np.array([[0, 1, 2]])
    found = uncovered(corners, faces, start, faces_of, sample, np.zeros((1, 1), dtype=np.int64), worst, pulls)
    s, t = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    s, t = s[s + t <= 1], t[s + t <= 1]
    dense = corners[0] + s[:, None] * (corners[1] - corners[0]) + t[:, None] * (corners[2] - corners[0])
    assert found == pytest.approx(np.linalg.norm(sample - dense, axis=1).min(), abs=0.03)


@settings(max_examples=8, deadline=None)
@given(
    st.tuples(*[st.floats(0.015, 0.05)] * 3),
    st.sampled_from(["centroid", "normal"]),
    st.booleans(),
)
def test_random_boxes_end_with_a_surface_without_nan(extents, pull, ground):
    import trimesh

    from tests.oracles.rasterise import ring_of_cameras

    box = trimesh.creation.box(extents)
    box.apply_translation([0.0, 0.0, extents[2] / 2])
    silhouettes = exact_silhouettes(box.vertices, box.faces, ring_of_cameras(np.asarray(box.center_mass)))
    parameters = SurfaceParameters(nodes=150, pull=pull, ground=ground, refinement_steps=10)
    *_, last = reconstruct(silhouettes, parameters)
    assert np.isfinite(last.points).all()
    assert np.isfinite(last.normals).all()
    assert np.all(np.abs(last.centroid - box.center_mass) < 0.004)
