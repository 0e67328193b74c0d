import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.geometry.mesh import mass_properties, moved, signed_volume
from graspbench.geometry.star_surface import cube_sphere


def test_a_box_has_the_moments_of_the_textbook():
    a, b, c = 0.03, 0.05, 0.08
    box = trimesh.creation.box((a, b, c))
    volume, centre, inertia = mass_properties(np.add(box.vertices, [1.0, -2.0, 0.5]), np.asarray(box.faces))
    assert volume == pytest.approx(a * b * c)
    np.testing.assert_allclose(centre, [1.0, -2.0, 0.5], atol=1e-12)
    expected = a * b * c / 12.0 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(inertia, expected, atol=1e-14)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_mass_properties_turn_with_the_body(seed):
    rng = np.random.default_rng(seed)
    points, faces = cube_sphere(3)
    points = points * rng.uniform(0.5, 2.0, 3) + rng.normal(size=3)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    volume, centre, inertia = mass_properties(points, faces)
    turned = mass_properties(points @ rotation.T, faces)
    assert turned[0] == pytest.approx(volume)
    np.testing.assert_allclose(turned[1], rotation @ centre, atol=1e-9)
    np.testing.assert_allclose(turned[2], rotation @ inertia @ rotation.T, atol=1e-9)


def test_volume_changes_sign_with_the_winding_and_scales_with_the_cube():
    points, faces = cube_sphere(4)
    assert signed_volume(points, faces) == pytest.approx(8.0)
    assert signed_volume(points, faces[:, ::-1]) == pytest.approx(-8.0)
    box = moved(trimesh.Trimesh(points, faces, process=False), 0.5 * np.eye(3), np.array([1.0, 0.0, 0.0]))
    assert signed_volume(box.vertices, box.faces) == pytest.approx(1.0)
    np.testing.assert_allclose(box.bounds.mean(axis=0), [1.0, 0.0, 0.0], atol=1e-12)
