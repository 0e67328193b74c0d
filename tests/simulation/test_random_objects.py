"""Odd shapes through the real camera: each ends with a sound surface or an error that names the cause."""

from dataclasses import replace

import numpy as np
import pytest

from graspbench.geometry import ObjectParameters, load_object
from graspbench.geometry.intersections import self_intersections
from graspbench.perception import CameraParameters, SilhouetteParameters, StationParameters, silhouettes
from graspbench.reconstruction import SurfaceParameters, VisualHull, enclosed_solid, reconstruct
from graspbench.simulation import SceneParameters, World
from graspbench.simulation.capture import capture

THIN, BRANCHED, STAR_SHAPED, HOLED = 357, 632, 166, 973


def _seen(number):
    model = load_object(ObjectParameters(name="random", id=number))
    with World(model, SceneParameters()) as world:
        views = capture(world, CameraParameters(), StationParameters())
    return model, silhouettes(views, SilhouetteParameters())


@pytest.mark.parametrize("number", [THIN, BRANCHED, STAR_SHAPED])
def test_a_random_object_ends_with_a_sound_surface(number):
    model, found = _seen(number)
    *_, last = reconstruct(found, SurfaceParameters())
    assert last.at_rest
    assert np.isfinite(last.points).all()
    np.testing.assert_allclose(np.linalg.norm(last.normals, axis=1), 1.0)
    assert np.abs(VisualHull(found).signed_distance(last.points)).max() < 0.1e-3
    assert not self_intersections(last.points, last.network.faces).any()
    volume, centroid = enclosed_solid(last.points, last.network)
    assert volume > 0.9 * model.mesh.volume
    if number == STAR_SHAPED:
        assert np.all(np.linalg.det(last.points[last.network.faces] - centroid) > 0)
        few = replace(SurfaceParameters(), pull="normal", wrap="hull", nodes=602, refinement_steps=15)
        *_, refined = reconstruct(found, few)
        assert not self_intersections(refined.points, refined.network.faces).any()


def test_a_holed_object_is_taken_with_its_holes():
    model, found = _seen(HOLED)
    assert model.mesh.is_watertight
    assert model.mesh.euler_number <= 0
    *_, last = reconstruct(found, SurfaceParameters(method="auto"))
    assert last.at_rest
    assert np.isfinite(last.points).all()
    assert np.abs(VisualHull(found).signed_distance(last.points)).mean() < 0.1e-3
