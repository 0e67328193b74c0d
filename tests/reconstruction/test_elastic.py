from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from graspbench.errors import ConfigurationError, ReconstructionError
from graspbench.reconstruction import METHODS, SurfaceParameters, VisualHull, reconstruct
from tests.oracles.scenes import INTRINSICS, moved, scaled, scene
from tests.oracles.triangles import crossing_triangles

SMALL = SurfaceParameters(nodes=402)
STAR_SHAPED = ["sphere", "egg", "bottle"]
CONFIGURATIONS = Path(__file__).parents[2] / "conf" / "surface"


def rest(silhouettes, parameters=SMALL, centre=None):
    *_, last = reconstruct(silhouettes, parameters, centre=centre)
    return last


def solid_angles_are_positive(surface, centre):
    corners = surface.points[surface.network.faces] - centre
    return np.all(np.linalg.det(corners) > 0)


@pytest.mark.parametrize("name", STAR_SHAPED)
def test_resting_nodes_lie_on_the_hulls_border(name):
    shapes = scene(name)
    surface = rest(shapes.silhouettes)
    distances = np.abs(VisualHull(shapes.silhouettes).signed_distance(surface.points))
    assert distances.mean() < 0.02e-3
    assert distances.max() < 0.3e-3


@pytest.mark.parametrize("pull", ["centroid", "normal"])
@pytest.mark.parametrize("name", STAR_SHAPED)
def test_star_shaped_networks_are_neither_inverted_nor_crossed(name, pull):
    shapes = scene(name)
    surface = rest(shapes.silhouettes, replace(SMALL, nodes=227, pull=pull))
    assert solid_angles_are_positive(surface, shapes.centre)
    assert not crossing_triangles(surface.points, surface.network.faces)


def test_surface_of_a_ball():
    shapes = scene("sphere")
    surface = rest(shapes.silhouettes)
    radii = np.linalg.norm(surface.points - shapes.centre, axis=1)
    assert np.abs(radii - 0.04).mean() < 0.6e-3
    assert np.linalg.norm(surface.centroid - shapes.centre) < 0.5e-3
    outward = (surface.points - shapes.centre) / radii[:, None]
    assert np.degrees(np.arccos((surface.normals * outward).sum(axis=1))).mean() < 4.0


@pytest.mark.parametrize("option", ["overdamped", "damped"])
def test_all_readings_end_on_the_same_surface(option):
    silhouettes = scene("bottle").silhouettes
    values = yaml.safe_load((CONFIGURATIONS / f"{option}.yaml").read_text())
    other = rest(silhouettes, SurfaceParameters(**values | {"nodes": 402}))
    gaps = np.linalg.norm(other.points - rest(silhouettes).points, axis=1)
    # Grazing views leave a few nodes free to slide a little along the border.
    assert np.quantile(gaps, 0.99) < 0.05e-3


def test_snapshots_start_on_the_ellipsoid_and_end_at_rest():
    shapes = scene("egg")
    surfaces = list(reconstruct(shapes.silhouettes, replace(SMALL, snapshot_every=3)))
    assert surfaces[0].iteration == 0
    assert not VisualHull(shapes.silhouettes).contains(surfaces[0].points).any()
    assert [s.at_rest for s in surfaces] == [False] * (len(surfaces) - 1) + [True]
    assert np.all(np.diff([s.iteration for s in surfaces])[:-1] == 3)
    assert len({id(s.network) for s in surfaces}) == 1
    crossings = [s.progress.crossings for s in surfaces]
    assert crossings == sorted(crossings)
    assert surfaces[-1].progress.crossed_nodes == surfaces[-1].network.size
    assert surfaces[-1].progress.energy_j < 1e-3 * max(s.progress.energy_j for s in surfaces)


def test_every_snapshot_is_a_closed_surface_around_the_centre():
    shapes = scene("bottle")
    for surface in reconstruct(shapes.silhouettes, SMALL):
        assert solid_angles_are_positive(surface, shapes.centre)
        np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0)


def test_work_is_done_lazily():
    surfaces = reconstruct(scene("egg").silhouettes, replace(SMALL, max_iterations=1, snapshot_every=1))
    assert next(surfaces).iteration == 0
    assert next(surfaces).iteration == 1
    with pytest.raises(ReconstructionError, match="nodes never reached"):
        next(surfaces)


def test_moving_scene_and_stations_moves_the_surface():
    shapes = scene("angle")
    parameters = replace(SMALL, ground=False)
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_euler("xyz", [0.4, 1.0, -2.0]).as_matrix()
    transform[:3, 3] = [0.3, -0.2, 0.5]
    here, there = rest(shapes.silhouettes, parameters), rest(moved(shapes.silhouettes, transform), parameters)
    expected = here.points @ transform[:3, :3].T + transform[:3, 3]
    np.testing.assert_allclose(there.points, expected, atol=1e-6)
    np.testing.assert_allclose(there.normals, here.normals @ transform[:3, :3].T, atol=1e-3)


def test_scaling_scene_stations_and_forces_scales_the_surface():
    shapes = scene("angle")
    larger = replace(SMALL, pull_n=2 * SMALL.pull_n, rest_step_m=2 * SMALL.rest_step_m)
    here, there = rest(shapes.silhouettes), rest(scaled(shapes.silhouettes, 2.0), larger)
    assert here.iteration == there.iteration
    np.testing.assert_allclose(there.points, 2.0 * here.points, atol=2e-6)


def test_scale_hardly_matters_with_the_same_forces():
    shapes = scene("egg")
    here, there = rest(shapes.silhouettes), rest(scaled(shapes.silhouettes, 2.0))
    assert np.abs(there.points - 2.0 * here.points).max() < 0.1e-3


def test_same_input_gives_the_same_surface():
    silhouettes = scene("mushroom").silhouettes
    parameters = replace(SMALL, pull="normal", refinement_steps=5)
    np.testing.assert_array_equal(rest(silhouettes, parameters).points, rest(silhouettes, parameters).points)


def test_bent_object_with_its_centre_outside():
    shapes = scene("angle")
    outside = np.array([0.05, 0.05, 0.01])
    surface = rest(shapes.silhouettes, centre=outside)
    hull = VisualHull(shapes.silhouettes)
    assert not hull.contains(outside[None])[0]
    assert np.abs(hull.signed_distance(surface.points)).max() < 0.5e-3


def test_seeing_everything_twice_changes_nothing():
    silhouettes = scene("angle").silhouettes
    np.testing.assert_allclose(rest(silhouettes * 2).points, rest(silhouettes).points, atol=1e-6)


def test_divergence_is_an_error_with_its_cause():
    stiff = replace(SMALL, stiffness_n_per_m=1e7, max_iterations=400)
    with pytest.raises(ReconstructionError, match=r"diverged within .*surface\.time_step_s"):
        rest(scene("egg").silhouettes, stiff)


def test_views_of_two_different_places_are_an_error():
    shapes = scene("sphere")
    away = np.eye(4)
    away[:3, 3] = [0.065, 0.065, 0.0]
    mixed = shapes.silhouettes[:6] + moved(shapes.silhouettes[6:], away)
    with pytest.raises(ReconstructionError, match="no point in common"):
        rest(mixed, centre=shapes.centre)


def test_any_iterator_of_surfaces_can_be_plugged_in():
    def frozen(silhouettes, parameters, centre):
        *_, last = METHODS["elastic"](silhouettes, replace(parameters, nodes=27), centre)
        yield replace(last, iteration=parameters.options["iteration"])

    METHODS.register("frozen")(frozen)
    chosen = replace(SMALL, method="frozen", options={"iteration": 7})
    (surface,) = reconstruct(scene("egg").silhouettes, chosen)
    assert surface.iteration == 7
    assert surface.network.size == 27
    with pytest.raises(ConfigurationError, match="unknown reconstruction 'nothing'"):
        reconstruct(scene("egg").silhouettes, replace(SMALL, method="nothing"))


@pytest.mark.parametrize("name", STAR_SHAPED)
def test_radial_bisection_finds_the_resting_surface(name):
    silhouettes = scene(name).silhouettes
    radial = rest(silhouettes, replace(SMALL, method="radial"))
    gaps = np.linalg.norm(radial.points - rest(silhouettes).points, axis=1)
    assert np.quantile(gaps, 0.97) < 0.05e-3


@pytest.mark.parametrize("path", sorted(CONFIGURATIONS.glob("*.yaml")), ids=lambda p: p.stem)
def test_every_configured_surface_comes_to_rest(path):
    parameters = SurfaceParameters(**yaml.safe_load(path.read_text()))
    surface = rest(scene("egg").silhouettes, replace(parameters, nodes=227))
    assert surface.at_rest
    pixel_m = 0.45 / INTRINSICS.fx
    distances = VisualHull(scene("egg").silhouettes).signed_distance(surface.points)
    assert np.abs(distances).max() < 0.5 * pixel_m
