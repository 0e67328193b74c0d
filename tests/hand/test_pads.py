import numpy as np
import pytest
import trimesh

from graspbench.hand.importing.pads import fit_pad

AXES = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # pads face down, tips point along x


def fingertip(radius: float) -> np.ndarray:
    link = trimesh.creation.capsule(0.03, radius)
    link.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0.0, 1.0, 0.0]))
    return np.asarray(link.vertices)


def directions_within(patch_deg: tuple[float, float, float], count: int) -> np.ndarray:
    side, low, high = np.radians(patch_deg)
    generator = np.random.default_rng(0)
    sides, ends = generator.uniform(-side, side, count), generator.uniform(low, high, count)
    local = np.column_stack((np.cos(ends) * np.cos(sides), np.sin(ends), np.cos(ends) * np.sin(sides)))
    return local @ AXES


@pytest.mark.parametrize("radius", [0.006, 0.009])
def test_sphere_stands_out_of_a_round_fingertip_a_little_all_over_its_pad(radius):
    points = fingertip(radius)
    pad = fit_pad(points, AXES)
    end = points[points[:, 0] >= points[:, 0].max() - 2.0 * radius]
    d = directions_within(pad.patch_deg, 300)
    proud = d @ pad.centre + pad.radius_m - (d @ end.T).max(axis=1)
    assert pad.patch_deg[0] == 60.0
    assert proud.min() >= 1.0e-3  # 1.2 mm in the directions that were fitted
    assert proud.max() <= pad.proud_m + 3e-4 <= 2.8e-3


def test_sphere_of_a_box_touches_first_near_its_pad():
    points = np.asarray(trimesh.creation.box((0.04, 0.02, 0.014)).subdivide_to_size(0.004).vertices)
    pad = fit_pad(points, AXES)
    d = directions_within(pad.patch_deg, 300)
    end = points[points[:, 0] >= points[:, 0].max() - 0.014]
    assert np.all(d @ pad.centre + pad.radius_m - (d @ end.T).max(axis=1) >= 1.0e-3)
    assert AXES[0] @ pad.centre + pad.radius_m >= 0.007 + 1.2e-3 - 1e-9


def test_given_radius_is_taken():
    assert fit_pad(fingertip(0.008), AXES, 0.005).radius_m == 0.005
