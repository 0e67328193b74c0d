import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.manipulation import charts
from tests.manipulation.cases import CHARTS

STEP = 1e-5


def coordinates(case, n=100):
    _, u, v = case
    rng = np.random.default_rng(0)
    return np.column_stack([rng.uniform(*u, n), rng.uniform(*v, n)])


def steps(case, k):
    _, u, v = case
    step = np.zeros(2)
    step[k] = STEP * (u, v)[k][1]
    return step


def test_tangents_and_spin_match_central_differences(chart_case):
    chart = chart_case[0]
    for xi in coordinates(chart_case):
        at = chart(xi)
        for k in range(2):
            step = steps(chart_case, k)
            ahead, behind = chart(xi + step), chart(xi - step)
            tangent = (ahead.point - behind.point) / (2 * step[k])
            spin = Rotation.from_matrix(ahead.frame @ behind.frame.T).as_rotvec() / (2 * step[k])
            assert np.linalg.norm(at.tangents[:, k] - tangent) <= 1e-6 * np.linalg.norm(tangent)
            assert np.linalg.norm(at.spin[:, k] - spin) <= 1e-6 * max(np.linalg.norm(spin), 1.0)


def test_gauss_frame_is_right_handed_and_tangent(chart_case):
    chart = chart_case[0]
    for xi in coordinates(chart_case, 20):
        at = chart(xi)
        np.testing.assert_allclose(at.frame.T @ at.frame, np.eye(3), atol=1e-12)
        assert np.linalg.det(at.frame) == pytest.approx(1.0)
        np.testing.assert_allclose(at.frame[:, 2] @ at.tangents, 0.0, atol=1e-12)
        u_axis = at.tangents[:, 0] / np.linalg.norm(at.tangents[:, 0])
        np.testing.assert_allclose(at.frame[:, 0], u_axis, atol=1e-12)


def test_charts_are_orthogonal(chart_case):
    chart = chart_case[0]
    for xi in coordinates(chart_case, 50) if chart.name != "mesh patch" else [np.zeros(2)]:
        u, v = chart(xi).tangents.T
        cosine = u @ v / np.linalg.norm(u) / np.linalg.norm(v)
        # a fitted patch is orthogonal at its centre up to the slope of the fit there
        assert abs(cosine) < (1e-10 if chart.name != "mesh patch" else 1e-2)


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "oblate", "prolate", "cylinder"])
def test_normals_point_out_of_convex_surfaces(name):
    chart = CHARTS[name][0]
    centre = chart.origin
    for xi in coordinates(CHARTS[name], 20):
        at = chart(xi)
        assert (at.point - centre) @ at.frame[:, 2] > 0.0


def test_ellipsoid_points_satisfy_its_equation_and_gradient():
    semi_axes = np.array([0.04, 0.07, 0.05])
    rotation = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    chart = charts.ellipsoid(semi_axes, rotation=rotation)
    for u, v in np.random.default_rng(1).uniform([-3, -1.4], [3, 1.4], (50, 2)):
        at = chart([u, v])
        local = rotation.T @ at.point
        assert np.sum((local / semi_axes) ** 2) == pytest.approx(1.0)
        gradient = rotation @ (local / semi_axes**2)
        np.testing.assert_allclose(at.frame[:, 2], gradient / np.linalg.norm(gradient), atol=1e-9)


def test_spin_of_simple_surfaces_has_its_closed_form():
    np.testing.assert_allclose(charts.plane()([0.3, 0.2]).spin, 0.0, atol=1e-15)
    # on the equator of a sphere: longitude turns about z, latitude about -y
    spin = charts.sphere(0.05)([0.0, 0.0]).spin
    np.testing.assert_allclose(spin, [[0, 0], [0, -1], [1, 0]], atol=1e-12)
    spin = charts.cylinder(0.05)([0.0, 0.3]).spin
    np.testing.assert_allclose(spin, [[0, 0], [0, 0], [1, 0]], atol=1e-12)


def test_equal_axes_make_a_sphere_of_any_orientation():
    chart = charts.ellipsoid([0.05, 0.05, 0.05], rotation=Rotation.from_rotvec([1, 0, 0]).as_matrix())
    assert np.linalg.norm(chart([0.4, 0.3]).point) == pytest.approx(0.05)


def test_locate_inverts_the_chart(chart_case):
    chart = chart_case[0]
    for xi in coordinates(chart_case, 5):
        found = chart.locate(chart(xi).point)
        np.testing.assert_allclose(chart(found).point, chart(xi).point, atol=1e-10)
        assert np.all((chart.domain[:, 0] <= found) & (found <= chart.domain[:, 1]))


def test_locate_refuses_a_point_off_the_surface():
    with pytest.raises(ManipulationError, match="off the sphere chart"):
        charts.sphere(0.05).locate(np.array([0.2, 0.0, 0.0]))


def test_mesh_patch_follows_a_curved_surface():
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(3000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    points = 0.05 * direction + rng.normal(scale=2e-5, size=(3000, 3))
    patch = charts.mesh_patch(points, 0.05 * direction[0], direction[0], radius_m=0.015)
    for xi in rng.uniform(-0.008, 0.008, (30, 2)):
        at = patch(xi)
        assert np.linalg.norm(at.point) == pytest.approx(0.05, abs=1e-4)
        assert at.frame[:, 2] @ at.point / 0.05 > np.cos(np.deg2rad(2.0))


def test_bad_charts_are_refused():
    with pytest.raises(ConfigurationError, match="positive"):
        charts.sphere(-1.0)
    with pytest.raises(ConfigurationError, match="rotation"):
        charts.plane(rotation=np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(ConfigurationError, match="4 or more"):
        charts.revolution([1, 1, 1], [0, 1, 2])
    with pytest.raises(ManipulationError, match="few vertices"):
        charts.mesh_patch(np.eye(3), np.zeros(3), np.array([0.0, 0.0, 1.0]))
