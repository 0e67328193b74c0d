"""Soft pads against closed forms: patch, torsion, stiffness, and the wrenches that two of them hold."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize

from graspbench.grasp import QualityParameters, grasp_quality
from graspbench.grasp.contact import contact_polytope
from graspbench.grasp.soft_pad import PadParameters, limit_use

CENTRE = np.zeros(3)
PAIR = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])


def test_hertz_pressure_has_its_closed_form_and_uniform_pressure_too():
    assert PadParameters(pressure_exponent=2.0).lever == pytest.approx(3.0 * np.pi / 16.0, rel=1e-12)
    assert PadParameters(pressure_exponent=1000.0).lever == pytest.approx(2.0 / 3.0, rel=0.01)


@pytest.mark.parametrize("k", [1.0, 1.7, 4.0])
def test_lever_is_the_mean_distance_of_the_pressure(k):
    def pressure(x):
        return (1.0 - x**k) ** (1.0 / k)

    expected = quad(lambda x: x**2 * pressure(x), 0, 1)[0] / quad(lambda x: x * pressure(x), 0, 1)[0]
    assert PadParameters(pressure_exponent=k).lever == pytest.approx(expected, rel=1e-6)


def test_a_linear_elastic_pad_is_hertz_sphere():
    radius, modulus = 0.008, 4e5  # of the tip, and E* of pad and object together
    pad = PadParameters(radius_m=(3.0 * radius / (4.0 * modulus)) ** (1 / 3))
    for force in (0.5, 3.0, 20.0):
        found = pad.yielding(force, radius)
        deep = (9.0 * force**2 / (16.0 * radius * modulus**2)) ** (1 / 3)
        assert found.indentation_m == pytest.approx(deep, rel=1e-9)
        assert found.normal_n_per_m == pytest.approx(2.0 * modulus * pad.patch_radius_m(force), rel=1e-9)
        step = 1e-6 * force
        slope = (
            2
            * step
            / (
                pad.yielding(force + step, radius).indentation_m
                - pad.yielding(force - step, radius).indentation_m
            )
        )
        assert found.normal_n_per_m == pytest.approx(slope, rel=1e-6)


def test_the_true_limit_surface_is_near_the_ellipse_and_touches_it_on_its_axes():
    """A disc with Hertz's pressure turns about centres near and far; Coulomb's law is integrated over it."""
    pad, friction = PadParameters(), 0.5
    radii = (np.arange(400) + 0.5) / 400
    angles = 2 * np.pi * (np.arange(200) + 0.5) / 200
    r, a = np.meshgrid(radii, angles, indexing="ij")
    x, y = r * np.cos(a), r * np.sin(a)
    load = np.sqrt(1.0 - r**2) * r
    load /= load.sum()
    patch = pad.patch_radius_m(2.0)
    uses = []
    for distance in [0.0, 0.2, 0.5, 1.0, 2.0, 5.0, 1e4]:
        speed = np.hypot(x - distance, y)
        force = np.abs(np.sum(friction * load * (x - distance) / speed)) * 2.0
        torque = np.sum(friction * load * (x * (x - distance) + y * y) / speed) * patch * 2.0
        uses.append(limit_use(force, torque, 2.0, friction, pad.torsion_m(2.0, friction)))
    assert uses[0] == pytest.approx(1.0, rel=0.01)
    assert uses[-1] == pytest.approx(1.0, rel=0.01)
    assert min(uses) > 0.9
    assert max(uses) < 1.1


@pytest.mark.parametrize("edges", [4, 8, 16])
def test_the_polyhedron_is_inside_the_ellipsoid_and_its_edges_and_sides_are_its_own(edges):
    polytope = contact_polytope("soft_pad", 0.5, edges, 0.1)
    unit = polytope.vertices[:, [0, 1, 3]] / [0.5, 0.5, 0.1]
    np.testing.assert_allclose(np.linalg.norm(unit, axis=1), 1.0, atol=1e-12)
    # every side is a supporting plane, and Euler's formula counts corners, edges and sides
    sides = unit[polytope.faces[2]]
    normals = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    heights = np.einsum("sk,vk->sv", normals, unit) - np.sum(normals * sides[:, 0], axis=1)[:, None]
    assert np.all((heights.max(axis=1) < 1e-12) | (heights.min(axis=1) > -1e-12))
    corners, edges_, faces = (len(polytope.faces[k]) for k in range(3))
    assert corners - edges_ + faces == 2


def test_two_opposite_pads_hold_the_moment_of_their_patches_and_no_more():
    """The axis between two pads is their weakest direction: Q3 is e over the torque length."""
    length = 0.04
    for load in (1.0, 8.0):
        quality = QualityParameters(contact="soft_pad", pad=PadParameters(load_n=load))
        torsion = quality.torsion(length)
        closed = 3.0 * np.pi / 16.0 * 0.5 * 0.0025 * load ** (1 / 3) / length
        assert torsion == pytest.approx(closed, rel=1e-9)
        found = grasp_quality(
            length * PAIR, -PAIR, CENTRE, contact="soft_pad", torque_length=length, torsional_friction=torsion
        )
        assert closed * (1.0 - 1e-3) <= found.q3 <= closed * (1.0 + 1e-9)


def test_fine_cones_come_to_the_ball_of_the_ellipsoids_themselves():
    rng = np.random.default_rng(1)
    angles = np.array([0.0, 2.0, 4.1])
    points = np.column_stack([np.cos(angles), np.sin(angles), [0.0, 0.2, -0.1]])
    normals, friction, torsion = -points / np.linalg.norm(points, axis=1, keepdims=True), 0.5, 0.05

    def support(d):
        pushes = d[:3] + np.cross(d[3:], points)
        along = np.sum(pushes * normals, axis=1)
        across = np.linalg.norm(pushes - along[:, None] * normals, axis=1)
        return along + np.hypot(friction * across, torsion * (normals @ d[3:]))

    # the least t with every contact's support below t, over unit directions d
    found = [
        minimize(
            lambda x: x[6],
            np.append(start := rng.normal(size=6) / 3.0, support(start).max()),
            method="SLSQP",
            constraints=[
                {"type": "ineq", "fun": lambda x: x[6] - support(x[:6])},
                {"type": "eq", "fun": lambda x: x[:6] @ x[:6] - 1.0},
            ],
        )
        for _ in range(30)
    ]
    exact = min(each.fun for each in found if each.success)
    quality = [
        grasp_quality(
            points, normals, CENTRE, contact="soft_pad", cone_edges=m, torsional_friction=torsion
        ).q3
        for m in (8, 16)
    ]
    assert quality[0] < quality[1] <= exact * (1 + 1e-6)
    assert quality[1] == pytest.approx(exact, rel=0.03)
